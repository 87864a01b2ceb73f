#pragma once

#include <filesystem>
#include <string>

#include "trundle/geometry/trajectory.hpp"
#include "trundle/io/pieces.hpp"
#include "trundle/recording/recording.hpp"

namespace trundle::recording {

/// The reference as a trajectory of the reference sensor: samples where x, y and heading are all there.
[[nodiscard]] Trajectory reference_trajectory(const Recording& recording);

/// trajectory.csv, .tum or reference.csv; where no row has a heading, its positions. Throws InputError.
[[nodiscard]] Trajectory read_trajectory(const std::filesystem::path& path);
[[nodiscard]] std::string to_csv(const Trajectory& trajectory);
[[nodiscard]] std::string to_tum(const Trajectory& trajectory);
/// The same piece by piece: as text a trajectory is twice as large as its numbers.
void write_csv(const Trajectory& trajectory, const TakeText& take);
void write_tum(const Trajectory& trajectory, const TakeText& take);

enum class TrajectoryFormat { csv, tum };

/// Writes poses as they come, with the bytes of to_csv() and to_tum().
class TrajectoryWriter {
 public:
  /// `take` must outlive it.
  TrajectoryWriter(TrajectoryFormat format, bool with_covariance, const TakeText& take);

  /// The covariance counts where it is written.
  void add(const StampedPose& pose, const Matrix3& covariance);
  /// Hands on what is left.
  void finish();

 private:
  void end_line();

  TrajectoryFormat format_;
  bool with_covariance_;
  const TakeText& take_;
  std::string text_;
};

/// The trajectory as read_trajectory() gives it of a file that holds to_csv() of it: of the covariances one
/// half is written, of equal stamps the first is kept, headings go on without jumps.
[[nodiscard]] Trajectory as_written(const Trajectory& trajectory);

}  // namespace trundle::recording
