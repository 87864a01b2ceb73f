#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "trundle/pipeline/files.hpp"
#include "trundle/pipeline/run.hpp"

namespace trundle::pipeline {

/// All that a run starts from.
struct RunInputs {
  RunQuestion question;
  RobotFile given;                    ///< before any calibration
  RobotFile robot;                    ///< as it is used, unless the run calibrates it
  std::vector<Recording> recordings;  ///< what is asked about: one, or those of a session
  std::vector<Recording> training;    ///< where others are to be learned from
  Provenance provenance;

  bool is_session() const { return recordings.size() > 1; }
  const Recording& recording() const { return recordings.front(); }
  std::filesystem::path in_folder(const std::string& name) const { return question.output / name; }
};

/// Reads everything that is named, so that a wrong input is found before anything is done. Throws InputError.
RunInputs read_run_inputs(const RunQuestion& question);

/// The record of a run of which no stage was done yet.
RunRecord record_of(const RunInputs& inputs);

/// Removes what an earlier run left of what this one has not written: a result is of one run.
void forget_earlier(const RunInputs& inputs, const RunRecord& record);

}  // namespace trundle::pipeline
