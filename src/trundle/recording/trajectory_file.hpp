#pragma once

#include "trundle/geometry/trajectory.hpp"

namespace trundle {

/// The trajectory as read_trajectory() gives it of a file that holds to_csv() of it: of the covariances one
/// half is written, of equal stamps the first is kept, headings go on without jumps.
[[nodiscard]] Trajectory as_written(const Trajectory& trajectory);

}  // namespace trundle
