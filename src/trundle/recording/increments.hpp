#pragma once

#include <filesystem>
#include <string>

#include "trundle/recording/alignment/align.hpp"
#include "trundle/recording/recording.hpp"

namespace trundle {

/// The reference as a trajectory of the reference sensor: samples where x, y and heading are all there.
Trajectory reference_trajectory(const Recording& recording);

/// trajectory.csv, .tum or reference.csv.
Trajectory read_trajectory(const std::filesystem::path& path);
std::string to_csv(const Trajectory& trajectory);
std::string to_tum(const Trajectory& trajectory);

}  // namespace trundle
