#pragma once

#include <array>
#include <optional>
#include <vector>

#include "trundle/calibration/likelihood/information.hpp"
#include "trundle/calibration/likelihood/relative_kernel.hpp"
#include "trundle/calibration/problem/run.hpp"

namespace trundle::calibration {

/// The relative motions of a run beside what was read over each, as columns for accumulate_relative.
struct RelativeTable {
  std::array<std::vector<double>, kMaxInputs> input;
  std::array<std::vector<double>, 3> motion;  ///< x [m], y [m], heading [rad]
  bool with_gyro = false;
  bool with_duration = false;  ///< the gyro's integral and the duration stand behind the wheels

  std::size_t rows() const { return motion[0].size(); }
};

/// Nothing where that does not hold the whole problem: H is not square, some motion spans several increments,
/// or the gyro is missing in some. Motions that the readings do not cover are left out.
std::optional<RelativeTable> relative_table(const Run& run, const Robot& robot);

/// What the table says about the parameters, in consecutive blocks.
std::vector<Information> relative_information(const RelativeTable& table, const Robot& robot,
                                              std::span<const Parameter> parameters,
                                              const RelativeWeights& weights, std::size_t blocks);

}  // namespace trundle::calibration
