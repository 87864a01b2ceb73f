// A filter carries twelve systematic errors along. Of a calibration that leaves more open it must be the
// large ones.
#include "trundle/slam/models/systematic_errors.hpp"

#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace trundle::slam {
namespace {

/// A swerve drive that was calibrated: nearly all of it is known to a thousandth of what it may be off
/// without.
Robot calibrated_swerve() {
  Robot robot;
  robot.chassis = swerve({0.1, 4096.0, 0}, 0.5, 0.6);
  robot.wheel_names = {"fl", "fr", "rl", "rr"};
  std::vector<Parameter> parameters;
  for (int wheel = 0; wheel < 4; ++wheel)
    for (const ParameterKind kind : {ParameterKind::diameter, ParameterKind::place_x, ParameterKind::place_y,
                                     ParameterKind::steering_zero})
      parameters.push_back({kind, wheel});
  robot.calibration.emplace();
  const auto count = static_cast<Eigen::Index>(parameters.size());
  robot.calibration->covariance = Eigen::MatrixXd::Zero(count, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Parameter& parameter = parameters[static_cast<std::size_t>(i)];
    const double sigma = 1e-3 * prior_sigma(parameter, robot);
    robot.calibration->parameters.push_back(
        {.name = name_of(parameter, robot), .unit = std::string(unit_of(parameter)), .observable = true});
    robot.calibration->covariance(i, i) = sigma * sigma;
  }
  return robot;
}

double variance_kept(const SystematicErrors& errors, std::size_t parameter) {
  return errors.by_component.row(static_cast<Eigen::Index>(parameter)).squaredNorm();
}

TEST(SystematicErrors, OfMoreThanTheyHoldTheyAreTheLargeOnes) {
  const Robot known = calibrated_swerve();
  const std::size_t parameters = known.calibration->parameters.size();
  ASSERT_GT(parameters, std::size_t{kMostSystematic});
  for (std::size_t open = 0; open < parameters; ++open) {  // each in turn is what no run showed
    Robot robot = known;
    const auto at = static_cast<Eigen::Index>(open);
    robot.calibration->covariance(at, at) *= 1e6;
    const SystematicErrors errors = systematic_errors_of(robot, false);
    EXPECT_EQ(errors.count(), kMostSystematic);
    EXPECT_NEAR(variance_kept(errors, open) / robot.calibration->covariance(at, at), 1.0, 1e-9)
        << errors.names[open];
  }
}

TEST(SystematicErrors, OfAsManyAsTheyHoldNothingIsLost) {
  Robot robot = calibrated_swerve();
  robot.calibration->parameters.resize(kMostSystematic);
  robot.calibration->covariance.conservativeResize(kMostSystematic, kMostSystematic);
  robot.calibration->covariance(0, 5) = robot.calibration->covariance(5, 0) =
      0.9 * std::sqrt(robot.calibration->covariance(0, 0) * robot.calibration->covariance(5, 5));
  const SystematicErrors errors = systematic_errors_of(robot, false);
  const Eigen::MatrixXd kept = errors.by_component * errors.by_component.transpose();
  EXPECT_TRUE(kept.isApprox(robot.calibration->covariance, 1e-12));
}

}  // namespace
}  // namespace trundle::slam
