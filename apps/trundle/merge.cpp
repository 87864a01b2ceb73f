#include <memory>

#include <fmt/format.h>

#include "trundle/pipeline/merge_answer.hpp"
#include "trundle/pipeline/outputs.hpp"

#include "command.hpp"
#include "shared_output.hpp"

namespace trundle::app {
namespace {

struct MergeArguments {
  Common common;
  MergeQuestion question;
  std::string output;
};

std::string text_of(const MergeArguments& options, const MergeAnswer& answer) {
  const MergedMap& merged = answer.merged;
  std::string text =
      fmt::format("{} maps: {} landmarks; cost {:.1f}, {} degrees of freedom\n", answer.maps.size(),
                  merged.map.positions.size(), merged.cost, merged.degrees_of_freedom);
  for (std::size_t k = 0; k < answer.maps.size(); ++k) {
    const Pose2& frame = merged.first_from_map[k];
    text += fmt::format("  {}: {} of {} landmarks shared; frame: x {:.4f} m, y {:.4f} m, heading {:.3f}°\n",
                        answer.maps[k], shared_landmarks(merged, k), answer.landmarks[k], frame.x, frame.y,
                        degrees(wrap_angle(frame.heading)));
  }
  text += fmt::format("written to {}: landmarks.csv, landmarks_covariance.csv, merge.json\n", options.output);
  return text;
}

void run_merge(const MergeArguments& options) {
  ResultFolder results(options.output);
  const MergeAnswer answer = answer_merge(options.question);
  write_set(results, options.output, files_of(answer, options.output), answer.provenance.inputs,
            {"slam.json"}, "merge.json");
  print(options.common, document_of(answer), text_of(options, answer));
}

}  // namespace

void add_merge(CLI::App& app) {
  auto options = std::make_shared<MergeArguments>();
  CLI::App* command = add_command(app, "merge", "Merge maps of several robots or runs into one",
                                  "trundle merge out/a out/b -o out/merged", options->common);
  command->add_option("MAP", options->question.maps, "Folder of results with landmarks.csv, or such a file")
      ->required()
      ->expected(2, 1000);
  command->add_flag("--unknown-ids", options->question.unknown_ids,
                    "Forget the landmarks' names: which is which follows from how they lie");
  command->add_option("-o,--output", options->output, "Folder for the results")->required();
  command->callback([options] { run_merge(*options); });
}

}  // namespace trundle::app
