#pragma once

#include <optional>
#include <string>
#include <vector>

#include "trundle/chassis/parameter.hpp"
#include "trundle/slam/models/motion.hpp"
#include "trundle/slam/report.hpp"

namespace trundle::slam {

/// Which systematic errors s the motions of a recording have, and what is known of them beforehand: first the
/// gyro's bias, true less the robot file's; then what a calibration left open, or else the three shares of
/// motion_of. docs/theory/motion-and-sensor.md, eq. 1b.
struct SystematicErrors {
  bool has_bias = false;
  double bias_sigma_rad_s = 0.0;
  std::vector<Parameter> parameters = {};  ///< of the calibration, those that the motion depends on
  std::vector<std::string> names = {};     ///< of those
  std::vector<std::string> units = {};     ///< likewise
  Eigen::MatrixXd by_component = {};       ///< L of Σ_p = L Lᵀ: the parameters' errors are L s
  bool has_shares = true;

  [[nodiscard]] Eigen::Index count() const {
    return first_open() + by_component.cols() + (has_shares ? kShares : 0);
  }
  /// Where those after the bias begin.
  [[nodiscard]] Eigen::Index first_open() const { return has_bias ? 1 : 0; }
  /// 1σ of each; of shares `of_shares` [1, 1, rad/m], which are left out where that is nothing.
  [[nodiscard]] Systematic sigma(const std::optional<Vector3>& of_shares = {}) const;
};

/// What lengths count in.
enum class LengthsIn {
  sensor_metre,  ///< that of the landmark sensor's ranges, whatever that is (metre.hpp)
  true_metre,    ///< that of a map which is given
};

/// Those of a robot; `shares` in place of what its calibration left open. Throws InputError as
/// uncertain_parameters.
[[nodiscard]] SystematicErrors systematic_errors_of(const Robot& robot, bool shares,
                                                    LengthsIn lengths = LengthsIn::sensor_metre);

/// Of systematic errors with these sigmas, all but the bias, those that are not known exactly.
[[nodiscard]] std::vector<int> free_of(const Systematic& sigma, bool has_bias);

/// What an estimate says of one of them.
struct NamedError {
  std::string name;
  std::string unit;
  double value = 0.0;  ///< true less that of the robot file
  double sigma = 0.0;
};
[[nodiscard]] std::vector<NamedError> named_errors(const SystematicErrors& errors,
                                                   const PoseEstimate& estimate);

}  // namespace trundle::slam
