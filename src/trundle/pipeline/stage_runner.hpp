#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "trundle/io/error.hpp"
#include "trundle/io/finite.hpp"
#include "trundle/io/staging.hpp"
#include "trundle/pipeline/run_inputs.hpp"
#include "trundle/report/results.hpp"

namespace trundle::pipeline {

/// What a stage gives: a value for those after it, a sentence of it, and the files that say the same.
template <typename T>
struct Found {
  T value = {};
  std::string message = {};
  std::vector<OutputFile> files = {};
  std::vector<std::string> remarks = {};
};

/// Writes a file of the stage that calls it, whose `rest` is made meanwhile: among Found's files it then has
/// a sha256, and nothing to be written.
using WriteNow = std::function<OutputFile(OutputFile)>;

/// The disk is full, or the like: no fault of a stage, and the end of the run.
struct CannotWrite : InputError {
  explicit CannotWrite(const InputError& reason) : InputError(reason) {}
};

/// Thrown by a stage that has nothing to do.
struct NotApplicable {
  std::string why;
};

/// What became of a stage: the value where it is done, why not where it failed, neither where it was skipped.
template <typename T>
struct StageResult {
  std::optional<T> value = {};
  std::optional<Failure> failure = {};
};

/// The readings that were misread.
enum class Misread {
  motion,     ///< of wheels, gyro or velocity: nothing can be determined of the motion
  wires,      ///< signs or columns of wheels and gyro: the same, until a calibration has put them right
  reference,  ///< what others are compared with
  other,      ///< sightings, or clocks that differ: wheels and gyro alone are right
};
struct Misreading {
  Misread what = Misread::motion;
  std::string words;  ///< place and message
};
/// Whether the stage would tell nonsense then.
bool forbids(Misread what, StageKind stage);

/// Runs the stages one after the other: writes their files, notes them in the record, tells of them as they
/// go.
class StageRunner {
 public:
  StageRunner(const RunInputs& inputs, const ResultFolder& results, RunRecord& record,
              const OnProgress& on_progress)
      : inputs_(inputs), results_(results), record_(record), on_progress_(on_progress) {}

  /// Calls the stage, a function that returns a Found or throws NotApplicable, CannotAnswer or InputError.
  template <typename Function>
  auto operator()(StageKind kind, const Function& function) {
    StageResult<decltype(function().value)> result;
    Stage entry{.kind = kind};
    std::vector<OutputFile> files;
    begin(kind);
    written_now_.clear();
    try {
      require_allowed(kind);
      auto found = function();
      for (const OutputFile& file : found.files) require_finite(file.path, file.content);
      entry.status = StageStatus::done;
      entry.message = std::move(found.message);
      entry.remarks = std::move(found.remarks);
      files = std::move(found.files);
      result.value = std::move(found.value);
    } catch (const CannotWrite&) {
      throw;
    } catch (const NotApplicable& reason) {
      entry.status = StageStatus::skipped;
      entry.message = reason.why;
    } catch (const CannotAnswer& reason) {
      result.failure = failed(reason, entry);
    } catch (const InputError& reason) {
      result.failure = failed(reason, entry);
    }
    if (!result.value) discard_written();
    end(std::move(entry), files);
    return result;
  }

  /// From now on stages that would go by what was misread fail.
  void forbid(std::vector<Misreading> misreadings) { misreadings_ = std::move(misreadings); }
  /// What was misread has been put right.
  void permit(Misread what) {
    std::erase_if(misreadings_, [what](const Misreading& one) { return one.what == what; });
  }
  /// As WriteNow says, for the stage that is running. Throws CannotWrite, and what `rest` throws.
  OutputFile write_now(OutputFile file);
  /// Gives a file of a stage that is done a further name.
  void add_copy(StageKind kind, const std::filesystem::path& of, const std::filesystem::path& copy);
  /// Tells how far a long stage is.
  OnSteps steps_of(StageKind kind) const;
  /// The files that were written and the page draws, in the order of their names.
  std::vector<ResultSource> sources() const;
  /// Those of a stage that is done.
  std::vector<ResultSource> sources_of(StageKind kind) const;

 private:
  void begin(StageKind kind) const;
  void require_allowed(StageKind kind) const;
  static Failure failed(const std::exception& reason, Stage& entry);
  void end(Stage entry, const std::vector<OutputFile>& files);
  /// Their names relative to the folder.
  std::vector<std::string> save(const std::vector<OutputFile>& files);
  void discard_written();
  std::string name_in_folder(const std::filesystem::path& path) const;

  const RunInputs& inputs_;
  const ResultFolder& results_;
  RunRecord& record_;
  const OnProgress& on_progress_;
  std::vector<Misreading> misreadings_;
  std::vector<ResultSource> sources_;
  std::vector<std::filesystem::path> written_now_;  ///< by the stage that is running
};

}  // namespace trundle::pipeline
