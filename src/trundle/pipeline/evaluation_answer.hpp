#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "trundle/evaluation/evaluate.hpp"
#include "trundle/pipeline/files.hpp"
#include "trundle/pipeline/provenance.hpp"
#include "trundle/report/evaluation_result.hpp"

namespace trundle::pipeline {

/// A trajectory and the files that it came from.
struct TrajectoryFile {
  Trajectory trajectory;
  std::vector<InputFile> files;
  ReferenceSigmas noise = {};  ///< of a recording's reference
  std::size_t left_out = 0;    ///< poses of the file that were thinned out
};
/// trajectory.csv, .tum, reference.csv, or the reference of a recording folder. Throws InputError.
TrajectoryFile read_trajectory_file(const std::filesystem::path& path);
/// What it would give of the file that is written so.
TrajectoryFile written_trajectory(const Trajectory& trajectory, const OutputFile& file);
/// The reference of a recording that has been read from `path`.
TrajectoryFile reference_of(const Recording& recording, const std::filesystem::path& path);

struct EvaluationAnswer {
  Provenance provenance;
  Evaluation evaluation;
};

/// What `trundle evaluate` does; with a robot the estimate is of its body, and the reference of its reference
/// sensor. Errors are judged by what the reference is known to as well. Throws as evaluate.
EvaluationAnswer answer_evaluation(const TrajectoryFile& estimate, const TrajectoryFile& reference,
                                   EvaluateOptions options, const RobotFile* robot = nullptr);

/// What `trundle evaluate --json` prints.
nlohmann::ordered_json document_of(const EvaluationAnswer& answer);

}  // namespace trundle::pipeline
