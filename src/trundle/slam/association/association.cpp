#include "trundle/slam/association/association.hpp"

#include <algorithm>
#include <vector>

#include <Eigen/LU>

#include "trundle/slam/association/assignment.hpp"

namespace trundle::slam {
namespace {

using Index = Eigen::Index;

// Cost of a pairing outside the gate: more than any sum of costs that matter; small enough to keep their
// digits.
constexpr double kForbidden = 1e7;

/// Landmarks that pass the gate of some observation, each once.
std::vector<LandmarkId> possible_landmarks(const std::vector<std::vector<Fit>>& fits, double gate) {
  std::vector<LandmarkId> landmarks;
  for (const auto& of_one : fits)
    for (const Fit& fit : of_one)
      if (fit.nis <= gate && std::ranges::find(landmarks, fit.landmark) == landmarks.end())
        landmarks.push_back(fit.landmark);
  return landmarks;
}

/// Within the gate of a landmark that another observation shows it is not ambiguous: both are there.
bool is_ambiguous(const std::vector<Fit>& fits, const AssociationOptions& options) {
  return std::ranges::any_of(
      fits, [&](const Fit& fit) { return fit.nis > options.gate && fit.nis <= options.near * options.gate; });
}

}  // namespace

double cost_of_any_place(double max_range_m) {
  return 2.0 * std::log(kPi * max_range_m * max_range_m);
}

double cost_of_new(const AssociationOptions& options) {
  return 2.0 * std::log(2.0 * kPi * options.max_range_m / options.new_share);
}

double cost_at_peak(const Matrix2& S) {
  return 2.0 * std::log(2.0 * kPi) + std::log(S.determinant());
}

// Eq. 21: a column for each landmark, and one for each observation that stands for 'none of them'.
std::vector<Associated> associate(const std::vector<std::vector<Fit>>& fits,
                                  const AssociationOptions& options) {
  const std::vector<LandmarkId> possible = possible_landmarks(fits, options.gate);
  const auto rows = static_cast<Index>(fits.size());
  const auto landmarks = static_cast<Index>(possible.size());
  Eigen::MatrixXd cost = Eigen::MatrixXd::Constant(rows, landmarks + rows, kForbidden);
  const double none = cost_of_new(options);
  const auto column_of = [&](LandmarkId landmark) {
    return std::ranges::find(possible, landmark) - possible.begin();
  };
  for (Index row = 0; row < rows; ++row) {
    cost(row, landmarks + row) = none;
    for (const Fit& fit : fits[static_cast<std::size_t>(row)])
      if (fit.nis <= options.gate) cost(row, column_of(fit.landmark)) = fit.minus_two_log_p;
  }
  CheapestAssignment assignment;
  const std::vector<Index>& chosen = assignment.solve(cost);
  std::vector<Associated> result(fits.size());
  for (std::size_t i = 0; i < fits.size(); ++i) {
    if (chosen[i] < landmarks)
      result[i] = {Association::matched, possible[static_cast<std::size_t>(chosen[i])]};
    else if (!is_ambiguous(fits[i], options))
      result[i].kind = Association::new_landmark;
  }
  return result;
}

}  // namespace trundle::slam
