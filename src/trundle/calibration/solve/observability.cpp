#include "trundle/calibration/solve/observability.hpp"

#include <algorithm>
#include <limits>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "trundle/calibration/problem/problem.hpp"
#include "trundle/calibration/solve/own_axes.hpp"
#include "trundle/chassis/rows.hpp"
#include "trundle/geometry/decompositions.hpp"
#include "trundle/odometry/uncertain.hpp"

namespace trundle::calibration {
namespace {

// Information below this (in units of prior sigmas) is rounding noise.
constexpr double kNoInformation = 1e-9;
// Shares of a held combination, beside the largest, are rounded: to none or all of it.
constexpr double kMember = 0.5;
// Shares that differ by less are equal.
constexpr double kSameShare = 1e-6;

/// Orthonormal columns orthogonal to all held combinations.
Eigen::MatrixXd complement(const std::vector<HeldCombination>& held, Eigen::Index n) {
  if (held.empty()) return Eigen::MatrixXd::Identity(n, n);
  Eigen::MatrixXd constraints(n, static_cast<Eigen::Index>(held.size()));
  for (std::size_t i = 0; i < held.size(); ++i)
    constraints.col(static_cast<Eigen::Index>(i)) = held[i].combination;
  return orthogonal_complement(constraints);
}

bool is_of_steering(ParameterKind kind) {
  return kind == ParameterKind::steering_zero || kind == ParameterKind::steering_scale ||
         kind == ParameterKind::place_x || kind == ParameterKind::place_y;
}

/// Of one kind, or what says where one steered wheel stands and how: these make up for each other.
bool are_alike(const Parameter& a, const Parameter& b) {
  return a.kind == b.kind || (a.wheel == b.wheel && is_of_steering(a.kind) && is_of_steering(b.kind));
}

/// The part of a badly seen direction that belongs to the kind of parameter it is mostly made of.
HeldCombination combination_of(const Eigen::VectorXd& direction, std::span<const Parameter> parameters,
                               const std::vector<HeldCombination>& held) {
  const double peak = direction.cwiseAbs().maxCoeff();
  Eigen::Index largest = 0;  // of equals the first: which one rounding makes the largest is chance
  while (std::abs(direction[largest]) < (1.0 - kSameShare) * peak) ++largest;
  HeldCombination result{Eigen::VectorXd::Zero(direction.size()), direction, {}};
  for (Eigen::Index i = 0; i < direction.size(); ++i) {
    const bool alike =
        are_alike(parameters[static_cast<std::size_t>(i)], parameters[static_cast<std::size_t>(largest)]);
    if (!alike || std::abs(direction[i]) < kMember * peak) continue;
    // Equal shares: of two diameters, their mean is held.
    result.combination[i] = direction[i] > 0.0 ? 1.0 : -1.0;
    result.members.push_back(static_cast<int>(i));
  }
  // What is held stays held: only the new part counts.
  const Eigen::MatrixXd free = complement(held, direction.size());
  const Eigen::VectorXd fresh = free * (free.transpose() * result.combination);
  result.combination = (fresh.norm() > kMember ? fresh : direction).normalized();
  return result;
}

bool is_of_wheels(ParameterKind kind) {
  switch (kind) {
    case ParameterKind::diameter:
    case ParameterKind::direction:
    case ParameterKind::lever:
    case ParameterKind::track:
      return true;
    default:
      return false;
  }
}

/// By how much the wheels' readings [m] would differ in that motion (1 m or 1 rad), were the parameters
/// elsewhere by `direction` [prior sigmas].
double effect_on(const Vector3& motion, const Eigen::VectorXd& direction,
                 std::span<const Parameter> parameters, const Robot& nominal) {
  const Rows rows = rows_of(nominal.chassis, false);
  RowVector effect = RowVector::Zero(rows.count());
  for (std::size_t j = 0; j < parameters.size(); ++j) {
    const double moved = direction[static_cast<Eigen::Index>(j)] * prior_sigma(parameters[j], nominal);
    const RowVector growth = reading_growth(parameters[j], nominal.chassis, rows);
    effect += moved * growth.cwiseProduct(rows.H * motion);
    effect -= moved * (row_derivative(parameters[j], nominal.chassis, rows) * motion);
  }
  return effect.head(rows.measured).norm();
}

/// What to drive: the motion in which the combination would show most. It does not in those that were driven.
std::string motion_to_drive(const HeldCombination& held, std::span<const Parameter> parameters,
                            const Robot& nominal, bool measures_length) {
  const Rows rows = rows_of(nominal.chassis, false);
  const bool can_move_sideways = rows.measured == rows.count();
  const auto effect = [&](const Vector3& motion) {
    return effect_on(motion, held.direction, parameters, nominal);
  };
  const double ahead = effect(Vector3::UnitX());
  const double sideways = can_move_sideways ? effect(Vector3::UnitY()) : 0.0;
  const double turning = effect(Vector3::UnitZ());
  if (turning > std::max(ahead, sideways)) return "turn on the spot, or drive circles, both ways";
  if (sideways > ahead) return "drive sideways";
  return measures_length ? "drive straight ahead, and back" : "add one straight run of known length";
}

/// The directions of all wheels in common: which way the robot's own axes point.
bool is_ahead(const HeldCombination& held, std::span<const Parameter> parameters, const Robot& nominal) {
  if (held.members.size() != nominal.chassis.all_wheels().size()) return false;
  const double sign = held.combination[held.members.front()];
  return std::ranges::all_of(held.members, [&](int member) {
    return parameters[static_cast<std::size_t>(member)].kind == ParameterKind::direction &&
           held.combination[member] * sign > 0.0;
  });
}

/// Where all levers of omni wheels move with the origin.
bool is_origin(const HeldCombination& held, std::span<const Parameter> parameters, const Robot& nominal) {
  return parameters[static_cast<std::size_t>(held.members.front())].kind == ParameterKind::lever &&
         !origin_moved(parameters, nominal).empty();
}

/// Of the robot's own axes: nothing is wrong with them where the robot file has them.
bool is_choice(const HeldCombination& held, std::span<const Parameter> parameters, const Robot& nominal) {
  return is_ahead(held, parameters, nominal) || is_origin(held, parameters, nominal);
}

std::string advice(const HeldCombination& held, std::span<const Parameter> parameters, const Robot& nominal,
                   bool measures_length) {
  const ParameterKind kind = parameters[static_cast<std::size_t>(held.members.front())].kind;
  if (is_origin(held, parameters, nominal))
    return "measure the landmark sensor's place on the robot, --fix sensor.x --fix sensor.y";
  if (is_ahead(held, parameters, nominal)) return "measure headings too: no path shows which way it looks";
  if (is_of_wheels(kind)) return motion_to_drive(held, parameters, nominal, measures_length);
  switch (kind) {
    case ParameterKind::steering_zero:
      return "drive straight ahead, and back";
    case ParameterKind::steering_scale:
    case ParameterKind::place_x:
    case ParameterKind::place_y:
      return "drive curves of very different radii, the tightest that it can";
    case ParameterKind::velocity_forward_scale:
      return measures_length ? "drive straight ahead, and back" : "add one straight run of known length";
    case ParameterKind::velocity_yaw_scale:
      return "turn on the spot, or drive circles, both ways";
    case ParameterKind::velocity_yaw_per_forward:
      return "drive straight ahead, and back, with the heading measured";
    case ParameterKind::velocity_yaw_bias:
      return "drive longer, and at different speeds, with the heading measured";
    case ParameterKind::icr_x:
      return "turn on the spot with the position measured";
    case ParameterKind::scrub:
      return "drive wide curves and sharp ones, and turn on the spot";
    case ParameterKind::tyre_growth:
      return "drive far at very different speeds, with the way measured";
    case ParameterKind::gyro_scale:
      return "add several full turns of measured angle";
    case ParameterKind::gyro_bias:
      return "stand still for ten seconds";
    case ParameterKind::gyro_time_offset:
      return "change the turn rate often";
    case ParameterKind::reference_x:
    case ParameterKind::reference_y:
      return "turn on the spot with the sensor's position measured";
    case ParameterKind::reference_heading:
      return "drive a straight line";
    case ParameterKind::sensor_range_offset:
      return "see landmarks from near and from far, from all sides";
    case ParameterKind::sensor_range_scale:
      return nominal.chassis.wheel_count == 0 ? "fix velocity.forward_scale, which lengths come from as well"
                                              : "fix the diameters, which lengths come from as well";
    case ParameterKind::sensor_depth_share:
      return "see landmarks far ahead and at the edges of the field of view";
    case ParameterKind::sensor_bearing_offset:
    case ParameterKind::sensor_x:
    case ParameterKind::sensor_y:
      return "turn both ways, and on the spot, where landmarks are seen";
    default:
      return "change speed and direction often";
  }
}

/// The names of the members: those that change together, and those against which they do.
std::string names_of(const HeldCombination& held, std::span<const Parameter> parameters,
                     const Robot& nominal) {
  std::vector<std::string> together, against;
  const double sign = held.direction[held.members.front()];
  for (const int member : held.members)
    (held.direction[member] * sign > 0.0 ? together : against)
        .push_back(name_of(parameters[static_cast<std::size_t>(member)], nominal));
  if (held.members.size() == 1) return together.front();
  if (against.empty())
    return fmt::format("unobservable combination: {} in common", fmt::join(together, ", "));
  return fmt::format("unobservable combination: {} against {}", fmt::join(together, ", "),
                     fmt::join(against, ", "));
}

}  // namespace

bool EstimableSpace::estimates(int parameter) const {
  return basis.row(parameter).norm() > 1e-6;
}

EstimableSpace estimable_space(const Eigen::MatrixXd& information, std::span<const Parameter> parameters,
                               const Robot& nominal) {
  const Eigen::Index n = information.rows();
  EstimableSpace space;
  space.scale.resize(n);
  for (Eigen::Index i = 0; i < n; ++i)
    space.scale[i] = prior_sigma(parameters[static_cast<std::size_t>(i)], nominal);
  const Eigen::MatrixXd scaled = space.scale.asDiagonal() * information * space.scale.asDiagonal();
  for (bool first = true;; first = false) {
    space.basis = complement(space.held, n);
    if (space.basis.cols() == 0) break;
    const SymmetricEigen eigen = symmetric_eigen(congruent(scaled, space.basis));
    const Eigen::MatrixXd vectors = space.basis * eigen.vectors;
    Eigen::VectorXd variance = Eigen::VectorXd::Zero(n);
    for (Eigen::Index k = 0; k < eigen.values.size(); ++k) {
      const double seen = eigen.values[k];
      const double inverse = seen > kNoInformation ? 1.0 / seen : std::numeric_limits<double>::infinity();
      for (Eigen::Index i = 0; i < n; ++i)
        if (std::abs(vectors(i, k)) > 1e-6) variance[i] += inverse * vectors(i, k) * vectors(i, k);
    }
    if (first) {
      space.sigma_data = space.scale.cwiseProduct(variance.cwiseSqrt());
      for (Eigen::Index k = n - 1; k >= 0; --k) {
        const Eigen::VectorXd v = vectors.col(k);
        space.directions.push_back({std::sqrt(std::max(eigen.values[k], 0.0)), {v.begin(), v.end()}});
      }
    }
    if (eigen.values[0] >= 1.0) break;
    space.held.push_back(combination_of(vectors.col(0), parameters, space.held));
  }
  return space;
}

Eigen::MatrixXd constrained_inverse(const Eigen::MatrixXd& information, const EstimableSpace& space) {
  const Eigen::MatrixXd B = space.scale.asDiagonal() * space.basis;
  if (B.cols() == 0) return Eigen::MatrixXd::Zero(information.rows(), information.cols());
  return B * divide_ldlt(B, congruent(information, B)).transpose();
}

Eigen::MatrixXd prior_covariance(std::span<const Parameter> parameters, const Robot& nominal) {
  const auto n = static_cast<Eigen::Index>(parameters.size());
  return odometry::with_usual_parameters({parameters.begin(), parameters.end()}, nominal)
      .covariance.topLeftCorner(n, n);
}

Eigen::MatrixXd held_covariance(const Eigen::MatrixXd& information, const EstimableSpace& space,
                                std::span<const Parameter> parameters, const Robot& nominal) {
  const Eigen::Index n = information.rows();
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(n, n);
  std::vector<Eigen::VectorXd> wrong;  // what may be
  for (const HeldCombination& held : space.held)
    if (!is_choice(held, parameters, nominal)) wrong.push_back(held.combination);
  if (wrong.empty()) return covariance;
  Eigen::MatrixXd C(n, static_cast<Eigen::Index>(wrong.size()));  // in the parameters' own units
  Eigen::MatrixXd part = C;                                       // partᵀ x: how much of each is in x
  for (Eigen::Index i = 0; i < C.cols(); ++i) {
    C.col(i) = wrong[static_cast<std::size_t>(i)].cwiseProduct(space.scale);
    part.col(i) = wrong[static_cast<std::size_t>(i)].cwiseQuotient(space.scale);
  }
  const Eigen::MatrixXd D = C - constrained_inverse(information, space) * (information * C);
  return congruent(congruent(prior_covariance(parameters, nominal), part), Eigen::MatrixXd(D.transpose()));
}

HeldWords reason_for(const HeldCombination& held, std::span<const Parameter> parameters, const Robot& nominal,
                     bool measures_length) {
  return {
      names_of(held, parameters, nominal),
      fmt::format("not observable from these runs: {}", advice(held, parameters, nominal, measures_length))};
}

std::string words_for(const HeldCombination& held, std::span<const Parameter> parameters,
                      const Robot& nominal, bool measures_length) {
  const HeldWords reason = reason_for(held, parameters, nominal, measures_length);
  if (held.members.size() == 1) return fmt::format("{}: {}; fixed at nominal", reason.names, reason.advice);
  return fmt::format("{}: {}; this combination is fixed at nominal, all others are estimated; {}",
                     reason.names, reason.advice,
                     is_choice(held, parameters, nominal)
                         ? "the robot's own axes are those of the robot file"
                         : "how far nominal may be off is part of the ± of these parameters");
}

}  // namespace trundle::calibration
