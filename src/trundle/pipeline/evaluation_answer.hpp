#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "trundle/evaluation/evaluate.hpp"
#include "trundle/pipeline/files.hpp"
#include "trundle/pipeline/provenance.hpp"
#include "trundle/pipeline/reference_clock.hpp"
#include "trundle/report/evaluation_result.hpp"

namespace trundle::pipeline {

/// A trajectory and the files that it came from.
struct TrajectoryFile {
  Trajectory trajectory;
  std::vector<InputFile> files;
  ReferenceSigmas noise = {};                ///< of a recording's reference
  std::size_t left_out = 0;                  ///< poses of the file that were thinned out
  std::optional<ReferenceClock> clock = {};  ///< of a reference whose stamps were moved
};
/// trajectory.csv, .tum, reference.csv, or the reference of a recording folder. Throws InputError.
TrajectoryFile read_trajectory_file(const std::filesystem::path& path);
/// What it would give of the file that is written so.
TrajectoryFile written_trajectory(const Trajectory& trajectory, const OutputFile& file);
/// The reference of a recording that has been read from `path`.
TrajectoryFile reference_of(const Recording& recording, const std::filesystem::path& path);
/// The same, on the clock of the recording's sensors.
TrajectoryFile on_clock_of_sensors(const Recording& recording, const std::filesystem::path& path,
                                   const AlignedReadings& readings, const Robot& robot);

/// What is known of the clock of a reference before an estimate is compared with it.
struct ClockQuestion {
  const RobotFile* robot = nullptr;                        ///< whose body the estimate is of
  double longest_gap_s = EvaluateOptions{}.longest_gap_s;  ///< across longer ones it tells no motion
  std::optional<double> time_offset_s = {};                ///< stated: nothing is measured
};
/// The reference on the estimate's clock: by the sensors of its recording where it has the robot's, else by
/// how the estimate moves.
TrajectoryFile on_clock_of(const TrajectoryFile& estimate, TrajectoryFile reference,
                           const ClockQuestion& question);
TrajectoryFile on_clock_of(const TrajectoryFile& estimate, const Recording& recording,
                           const std::filesystem::path& path, const ClockQuestion& question);
/// Of what the path holds, as read_trajectory_file() takes it.
TrajectoryFile on_clock_of(const TrajectoryFile& estimate, const std::filesystem::path& path,
                           const ClockQuestion& question);

struct EvaluationAnswer {
  Provenance provenance;
  Evaluation evaluation;
  std::optional<ReferenceClock> clock = {};  ///< of the reference, whose stamps were moved
};

/// What `trundle evaluate` does; with a robot the estimate is of its body, and the reference of its reference
/// sensor. Errors are judged by what the reference is known to as well. Throws as evaluate.
EvaluationAnswer answer_evaluation(const TrajectoryFile& estimate, const TrajectoryFile& reference,
                                   EvaluateOptions options, const RobotFile* robot = nullptr);

/// What `trundle evaluate --json` prints.
nlohmann::ordered_json document_of(const EvaluationAnswer& answer);

}  // namespace trundle::pipeline
