#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "trundle/odometry/integrate.hpp"
#include "trundle/pipeline/files.hpp"
#include "trundle/report/provenance.hpp"
#include "trundle/report/slam_result.hpp"
#include "trundle/slip/event.hpp"

namespace trundle::pipeline {

/// Files that programs which draw recordings read: docs/viewers.md.
enum class ViewerFormat {
  mcap,    ///< messages of ROS 2
  wpilog,  ///< values of WPILib
};
/// By the name of its option, "mcap" or "wpilog", which is the ending of its files, too.
[[nodiscard]] std::optional<ViewerFormat> viewer_format_named(std::string_view name);
[[nodiscard]] std::string_view name_of(ViewerFormat format);
[[nodiscard]] std::vector<std::string> viewer_format_names();

/// A trajectory as viewers get it.
struct ShownTrajectory {
  std::string name;             ///< "slam online": of its topics and its frame
  bool has_covariance = false;  ///< else that of its poses is not known
  /// Hands its poses on, in order; the covariance counts where there is one.
  std::function<void(const TakePose&)> produce;
};

struct ShownSlip {
  SlipEvent event;
  std::string wheel;  ///< or "ambiguous"
};

/// What is known at the end, for a file of a viewer.
struct Shown {
  Provenance provenance;
  std::int64_t time_origin_s = 0;  ///< of the recording's stamps, on the clock of its log
  std::vector<ShownTrajectory> trajectories;
  std::vector<LandmarkRow> landmarks = {};
  std::vector<ShownSlip> slips = {};  ///< in order of their starts
};

/// Of a trajectory that is there, which must outlive it.
[[nodiscard]] ShownTrajectory shown(std::string name, const Trajectory& trajectory);

[[nodiscard]] std::vector<ShownSlip> shown_slips(const std::vector<SlipEvent>& events, const Robot& robot);

/// The file, which is computed while it is written. Throws then what the trajectories throw, and CannotAnswer
/// where a time is before 0, which neither format has.
[[nodiscard]] OutputFile viewer_file(const std::filesystem::path& path, ViewerFormat format, Shown shown);

}  // namespace trundle::pipeline
