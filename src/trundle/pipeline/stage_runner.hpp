#pragma once

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
  motion,     ///< of wheels, gyro or velocity: nothing can be told of the motion
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
    try {
      require_allowed(kind);
      auto found = function();
      for (const OutputFile& file : found.files) require_finite(file.path, file.content);
      entry.status = StageStatus::done;
      entry.message = std::move(found.message);
      entry.remarks = std::move(found.remarks);
      files = std::move(found.files);
      result.value = std::move(found.value);
    } catch (const NotApplicable& reason) {
      entry.status = StageStatus::skipped;
      entry.message = reason.why;
    } catch (const CannotAnswer& reason) {
      result.failure = failed(reason, entry);
    } catch (const InputError& reason) {
      result.failure = failed(reason, entry);
    }
    end(std::move(entry), files);
    return result;
  }

  /// From now on stages that would go by what was misread fail.
  void forbid(std::vector<Misreading> misreadings) { misreadings_ = std::move(misreadings); }
  /// Writes a further file of a stage that is done.
  void add_output(StageKind kind, const OutputFile& file);
  /// Tells how far a long stage is.
  OnSteps steps_of(StageKind kind) const;
  /// The files that were written and the page draws, in the order of their names.
  std::vector<ResultSource> sources() const;

 private:
  void begin(StageKind kind) const;
  void require_allowed(StageKind kind) const;
  static Failure failed(const std::exception& reason, Stage& entry);
  void end(Stage entry, const std::vector<OutputFile>& files);
  /// Their names relative to the folder.
  std::vector<std::string> save(const std::vector<OutputFile>& files);

  const RunInputs& inputs_;
  const ResultFolder& results_;
  RunRecord& record_;
  const OnProgress& on_progress_;
  std::vector<Misreading> misreadings_;
  std::vector<ResultSource> sources_;
};

}  // namespace trundle::pipeline
