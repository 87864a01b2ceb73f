#pragma once

#include <filesystem>
#include <optional>
#include <set>
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

/// Reads everything that is named, so that a wrong input is found before anything is done; not the robot file
/// where its content is given. Throws InputError.
RunInputs read_run_inputs(const RunQuestion& question, const std::optional<RobotFile>& robot = {});

/// The record of a run of which no stage was done yet.
RunRecord record_of(const RunInputs& inputs);

/// The names of all files in its folder that such a run may write, or has written when it was last there.
std::set<std::string> result_names(const RunInputs& inputs);

}  // namespace trundle::pipeline
