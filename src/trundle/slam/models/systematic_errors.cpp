#include "trundle/slam/models/systematic_errors.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "trundle/geometry/decompositions.hpp"
#include "trundle/slam/models/metre.hpp"

namespace trundle::slam {
namespace {

using Index = Eigen::Index;

constexpr double kNoVariance = 1e-14;  // of a direction, of that of the largest: rounding leaves as much

bool moves_the_body(const Parameter& parameter) {
  if (is_of_landmark_sensor(parameter.kind)) return false;
  switch (parameter.kind) {
    case ParameterKind::reference_x:
    case ParameterKind::reference_y:
    case ParameterKind::reference_heading:
    case ParameterKind::time_offset:
      return false;
    default:
      return true;
  }
}

/// L with L Lᵀ = covariance, the directions of largest variance first, those without any left out. They are
/// measured by how far off each parameter may be without any calibration (`scale`): of more than `most`,
/// those that are given up are the ones that are known best, in whatever units.
Eigen::MatrixXd root_of(const Eigen::MatrixXd& covariance, const Eigen::VectorXd& scale, Index most) {
  const Eigen::VectorXd per_scale = scale.cwiseInverse();
  const auto [variances, axes] =
      symmetric_eigen(per_scale.asDiagonal() * covariance * per_scale.asDiagonal());
  const double least = kNoVariance * variances.cwiseAbs().maxCoeff();
  const Index open = std::min<Index>((variances.array() > least).count(), most);
  return scale.asDiagonal() * axes.rowwise().reverse().leftCols(open) *
         variances.reverse().head(open).cwiseSqrt().asDiagonal();
}

void add_calibrated(const Robot& robot, LengthsIn lengths, SystematicErrors& errors) {
  UncertainParameters uncertain = uncertain_parameters(robot, true);
  if (lengths == LengthsIn::sensor_metre) count_in_sensor_metre(uncertain);
  std::vector<Index> moving;
  for (std::size_t i = 0; i < uncertain.parameters.size(); ++i) {
    if (!moves_the_body(uncertain.parameters[i])) continue;
    moving.push_back(static_cast<Index>(i));
    errors.parameters.push_back(uncertain.parameters[i]);
    errors.names.push_back(name_of(uncertain.parameters[i], robot));
    errors.units.emplace_back(unit_of(uncertain.parameters[i]));
  }
  if (moving.empty()) return;
  Eigen::VectorXd scale(errors.parameters.size());
  std::ranges::transform(errors.parameters, scale.begin(),
                         [&](const Parameter& parameter) { return prior_sigma(parameter, robot); });
  errors.by_component =
      root_of(uncertain.covariance(moving, moving), scale, kMostSystematic - errors.first_open());
}

}  // namespace

Systematic SystematicErrors::sigma(const std::optional<Vector3>& of_shares) const {
  const bool shares = has_shares && of_shares.has_value();
  Systematic sigma = Systematic::Ones(first_open() + by_component.cols() + (shares ? kShares : 0));
  if (has_bias) sigma[0] = bias_sigma_rad_s;
  if (shares) sigma.tail<kShares>() = *of_shares;
  return sigma;
}

SystematicErrors systematic_errors_of(const Robot& robot, bool shares, LengthsIn lengths) {
  SystematicErrors errors{.has_bias = robot.chassis.gyro.has_value()};
  if (errors.has_bias) errors.bias_sigma_rad_s = initial_bias_sigma(robot);
  if (robot.calibration && !shares) add_calibrated(robot, lengths, errors);
  errors.has_shares = errors.by_component.cols() == 0;
  return errors;
}

std::vector<int> free_of(const Systematic& sigma, bool has_bias) {
  std::vector<int> free;
  for (int i = has_bias ? 1 : 0; i < sigma.size(); ++i)
    if (sigma[i] > 0.0) free.push_back(i);
  return free;
}

std::vector<NamedError> named_errors(const SystematicErrors& errors, const PoseEstimate& estimate) {
  const Systematic& s = estimate.systematic;
  const SystematicCovariance& P = estimate.systematic_covariance;
  std::vector<NamedError> named;
  if (errors.has_bias && s.size() > 0)
    named.push_back({"gyro.bias", "rad/s", s[0], std::sqrt(std::max(0.0, P(0, 0)))});
  const Index first = errors.first_open();
  const Index open = errors.by_component.cols();
  for (std::size_t i = 0; i < errors.parameters.size() && s.size() >= first + open; ++i) {
    const Eigen::RowVectorXd row = errors.by_component.row(static_cast<Index>(i));
    named.push_back(
        {errors.names[i], errors.units[i], row.dot(s.segment(first, open)),
         std::sqrt(std::max(0.0, (row * P.block(first, first, open, open) * row.transpose())(0)))});
  }
  constexpr std::array kNames = {"travel", "turn", "turn_per_m"};
  constexpr std::array kUnits = {"1", "1", "rad/m"};
  for (Index i = 0; errors.has_shares && i < kShares && first + i < s.size(); ++i)
    named.push_back({kNames[static_cast<std::size_t>(i)], kUnits[static_cast<std::size_t>(i)], s[first + i],
                     std::sqrt(std::max(0.0, P(first + i, first + i)))});
  return named;
}

}  // namespace trundle::slam
