#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "trundle/chassis/robot.hpp"
#include "trundle/io/file.hpp"
#include "trundle/report/calibration_json.hpp"
#include "trundle/report/evaluation_result.hpp"
#include "trundle/report/growth_result.hpp"
#include "trundle/report/info_result.hpp"
#include "trundle/report/odometry_result.hpp"
#include "trundle/report/result_track.hpp"
#include "trundle/report/run_record.hpp"
#include "trundle/report/slam_result.hpp"
#include "trundle/report/slip_result.hpp"

namespace trundle::report {

/// A file of results that the page names.
struct ResultSource {
  std::string name;  ///< from the folder, without extension: "slam/trajectory"
  InputFile file;
  std::vector<std::string> made_by = {};  ///< the lines at the head of a CSV file, without their "# "
};

/// All that the page draws of one recording; what is not there was not found out. `run` fills it from what
/// its stages gave, `read_results` from a folder.
struct Results {
  std::string label;  ///< the folder, or the one file
  std::optional<RunRecord> run = {};
  std::optional<InfoResult> info = {};
  std::optional<CalibrationDocument> calibration = {};
  std::optional<OdometryResult> odometry = {};
  std::optional<SlipResult> slip = {};
  std::optional<SlamSummary> slam = {};
  std::optional<EvaluationSummary> evaluation = {};
  std::vector<ResultTrack> tracks = {};  ///< as they were estimated, the reference among them
  std::optional<std::vector<LandmarkRow>> landmarks = {};
  std::optional<ParticleColumns> particles = {};
  std::vector<GrowthResult> growth = {};  ///< of each robot that kept it
  std::optional<FilterColumns> filter = {};
  std::optional<SightingColumns> sightings = {};
  std::optional<Robot> robot = {};  ///< that was used: where its reference sensor is
  std::vector<ResultSource> sources = {};
};

/// In and below a folder, in its folder slam/; or of the one file: see result_files(). Without the robot.
/// Throws InputError at malformed files.
Results read_results(const std::filesystem::path& input);
/// The robot that a run used, if its file is still where run.json says: in the folder, or as it was given.
std::optional<Robot> read_robot_used(const std::optional<RunRecord>& run,
                                     const std::filesystem::path& folder);

/// A file as the page names it.
ResultSource source_of(const std::string& name, const std::filesystem::path& path, std::string_view content);

}  // namespace trundle::report
