#pragma once

#include <filesystem>

#include "trundle/recording/recording.hpp"

// Layouts of other projects that are recognised as they are.
namespace trundle::recording {

/// Censi's .tuple files [Censi et al., T-RO 2013]: JSON objects one after another, each with the duration T
/// [s] of an interval, the mean wheel rates phi_l and phi_r [rad/s] and the motion sm = [x, y, heading] of
/// the sensor in its own frame. Intervals follow each other from time 0. Wheels are named left and right.
void read_tuples(const std::filesystem::path& file, Recording& recording);

/// A folder of the UTIAS Multi-Robot Cooperative Localization and Mapping data set [Leung et al., IJRR 2011].
bool is_mrclam(const std::filesystem::path& folder);
/// One robot of it; 0: the only one. Sightings of robots and of unknown barcodes are left out and counted;
/// landmarks are named by their subject number.
void read_mrclam(const std::filesystem::path& folder, int robot_number, Recording& recording);

}  // namespace trundle::recording
