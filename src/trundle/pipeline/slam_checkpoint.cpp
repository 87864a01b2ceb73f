#include "trundle/pipeline/slam_checkpoint.hpp"

#include "trundle/io/archive.hpp"
#include "trundle/io/checkpoint.hpp"
#include "trundle/io/error.hpp"
#include "trundle/io/file.hpp"

namespace trundle::pipeline {
namespace {

constexpr std::string_view kSlamState = "slam";

/// What must be the same wherever a run is taken up.
struct Origin {
  std::string settings;
  std::string seen;  ///< SHA-256 of the steps that were done
  std::size_t steps = 0;

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.settings, self.seen, self.steps);
  }
};

std::string digest_of(const SlamInput& input, std::size_t steps) {
  StateWriter writer;
  for (std::size_t k = 0; k < steps; ++k) writer(input.steps[k]);
  return sha256_of(writer.take());
}

void store(const SlamRun& run, const SlamInput& input, const std::string& settings,
           const std::filesystem::path& path) {
  StateWriter writer;
  writer(Origin{settings, digest_of(input, run.steps()), run.steps()}, run);
  write_checkpoint(path, kSlamState, writer.take());
}

void require_same(const Origin& origin, const SlamInput& input, const std::string& settings,
                  const std::string& file) {
  if (origin.settings != settings)
    throw InputError(file, "was made with other options or another robot file",
                     "the same robot file, filter, particles, seed, start and ids");
  if (origin.steps > input.steps.size() || digest_of(input, origin.steps) != origin.seen)
    throw InputError(file, "was made from another recording", "the same recording, or a longer one");
}

/// `run` goes on where the stored one was left.
void take_up(SlamRun& run, const SlamInput& input, const std::string& settings,
             const std::filesystem::path& path) {
  const std::string state = read_checkpoint(path, kSlamState);
  StateReader reader(state);
  try {
    Origin origin;
    reader(origin);
    require_same(origin, input, settings, path.string());
    reader(run);
    reader.finish();
  } catch (const DamagedState&) {
    throw InputError(path.string(), "is not the state of such a run", "a file that --checkpoint wrote");
  }
}

/// When a run has come so far.
double time_of(const SlamRun& run, const SlamInput& input) {
  return run.steps() > 0 ? input.steps[run.steps() - 1].time_s : input.start_s;
}

}  // namespace

SlamResult slam_with_checkpoints(const SlamInput& input, SlamRun run, const std::string& settings,
                                 const SlamCheckpoints& checkpoints, const OnSteps& on_steps) {
  if (!checkpoints.resume.empty()) take_up(run, input, settings, checkpoints.resume);
  double stored_s = time_of(run, input);
  while (run.steps() < input.steps.size()) {
    // The last step may be cut elsewhere once the recording is longer: it is not in any checkpoint.
    const bool is_last = run.steps() + 1 == input.steps.size();
    const bool is_due = checkpoints.every_s && time_of(run, input) - stored_s >= *checkpoints.every_s;
    if (!checkpoints.write.empty() && (is_last || is_due)) {
      store(run, input, settings, checkpoints.write);
      stored_s = time_of(run, input);
    }
    run.step(input.steps[run.steps()]);
    if (on_steps) on_steps(run.steps(), input.steps.size());
  }
  return run.result();
}

}  // namespace trundle::pipeline
