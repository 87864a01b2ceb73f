#pragma once

#include <filesystem>
#include <string>

#include "trundle/geometry/trajectory.hpp"
#include "trundle/io/pieces.hpp"
#include "trundle/recording/recording.hpp"

namespace trundle::recording {

/// The reference as a trajectory of the reference sensor: samples where x, y and heading are all there.
[[nodiscard]] Trajectory reference_trajectory(const Recording& recording);

/// trajectory.csv, .tum or reference.csv. Throws InputError.
[[nodiscard]] Trajectory read_trajectory(const std::filesystem::path& path);
[[nodiscard]] std::string to_csv(const Trajectory& trajectory);
[[nodiscard]] std::string to_tum(const Trajectory& trajectory);
/// The same piece by piece: as text a trajectory is twice as large as its numbers.
void write_csv(const Trajectory& trajectory, const TakeText& take);
void write_tum(const Trajectory& trajectory, const TakeText& take);

/// The trajectory as read_trajectory() gives it of a file that holds to_csv() of it: of the covariances one
/// half is written, of equal stamps the first is kept, headings go on without jumps.
[[nodiscard]] Trajectory as_written(const Trajectory& trajectory);

}  // namespace trundle::recording
