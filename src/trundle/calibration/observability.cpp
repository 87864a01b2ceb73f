#include "trundle/calibration/observability.hpp"

#include <limits>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "trundle/geometry/decompositions.hpp"

namespace trundle::calibration {
namespace {

// Information below this (in units of prior sigmas) is rounding noise.
constexpr double kNoInformation = 1e-9;
// A parameter belongs to a held combination if its share is at least this part of the largest.
constexpr double kMember = 0.3;

/// Orthonormal columns orthogonal to all held combinations.
Eigen::MatrixXd complement(const std::vector<HeldCombination>& held, Eigen::Index n) {
  if (held.empty()) return Eigen::MatrixXd::Identity(n, n);
  Eigen::MatrixXd constraints(n, static_cast<Eigen::Index>(held.size()));
  for (std::size_t i = 0; i < held.size(); ++i)
    constraints.col(static_cast<Eigen::Index>(i)) = held[i].combination;
  return orthogonal_complement(constraints);
}

/// The part of a badly seen direction that belongs to the kind of parameter it is mostly made of.
HeldCombination combination_of(const Eigen::VectorXd& direction, std::span<const Parameter> parameters,
                               const std::vector<HeldCombination>& held) {
  Eigen::Index largest = 0;
  const double peak = direction.cwiseAbs().maxCoeff(&largest);
  HeldCombination result{Eigen::VectorXd::Zero(direction.size()), {}};
  for (Eigen::Index i = 0; i < direction.size(); ++i) {
    const bool alike =
        parameters[static_cast<std::size_t>(i)].kind == parameters[static_cast<std::size_t>(largest)].kind;
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

std::string diameter_words(bool common) {
  return common ? "the wheels' common diameter is not observable from these runs, only their ratios: add one "
                  "straight run of known length"
                : "not observable from these runs: add one straight run of known length";
}

std::string advice(ParameterKind kind, bool common) {
  switch (kind) {
    case ParameterKind::diameter:
      return diameter_words(common);
    case ParameterKind::direction:
      return "not observable from these runs: drive forwards and sideways";
    case ParameterKind::lever:
      return "not observable from these runs: turn on the spot several times both ways";
    case ParameterKind::track:
      return "not observable from these runs: turn on the spot, or drive circles, both ways";
    case ParameterKind::icr_x:
      return "not observable from these runs: turn on the spot with the position measured";
    case ParameterKind::gyro_scale:
      return "not observable from these runs: add several full turns of measured angle";
    case ParameterKind::gyro_bias:
      return "not observable from these runs: stand still for ten seconds";
    case ParameterKind::gyro_time_offset:
      return "not observable from these runs: change the turn rate often";
    case ParameterKind::reference_x:
    case ParameterKind::reference_y:
      return "not observable from these runs: turn on the spot with the sensor's position measured";
    case ParameterKind::reference_heading:
      return "not observable from these runs: drive a straight line";
    case ParameterKind::time_offset:
      return "not observable from these runs: change speed and direction often";
  }
  return {};
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
    const SymmetricEigen eigen = symmetric_eigen(space.basis.transpose() * scaled * space.basis);
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
    if (variance.maxCoeff() <= 1.0) break;
    space.held.push_back(combination_of(vectors.col(0), parameters, space.held));
  }
  return space;
}

Eigen::MatrixXd constrained_inverse(const Eigen::MatrixXd& information, const EstimableSpace& space) {
  const Eigen::MatrixXd B = space.scale.asDiagonal() * space.basis;
  if (B.cols() == 0) return Eigen::MatrixXd::Zero(information.rows(), information.cols());
  return B * divide_ldlt(B, B.transpose() * information * B).transpose();
}

HeldWords reason_for(const HeldCombination& held, std::span<const Parameter> parameters,
                     const Robot& nominal) {
  std::vector<std::string> names;
  for (const int member : held.members)
    names.push_back(name_of(parameters[static_cast<std::size_t>(member)], nominal));
  const bool common = held.members.size() > 1;
  const ParameterKind kind = parameters[static_cast<std::size_t>(held.members.front())].kind;
  return {fmt::format("{}{}", common ? "unobservable combination: " : "", fmt::join(names, ", ")),
          advice(kind, common)};
}

std::string words_for(const HeldCombination& held, std::span<const Parameter> parameters,
                      const Robot& nominal) {
  const HeldWords reason = reason_for(held, parameters, nominal);
  return fmt::format("{}: {}; held at nominal", reason.names, reason.advice);
}

}  // namespace trundle::calibration
