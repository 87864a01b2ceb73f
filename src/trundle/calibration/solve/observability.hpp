#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "trundle/calibration/result.hpp"

namespace trundle::calibration {

/// A combination of parameters that the runs cannot determine: it is held at its nominal value.
struct HeldCombination {
  Eigen::VectorXd combination;  ///< unit vector, parameters in units of their prior sigmas
  Eigen::VectorXd direction;    ///< the worst seen direction, which it stands for
  std::vector<int> members;     ///< indices of the parameters in it
};

/// Which directions of parameter space the runs can determine.
struct EstimableSpace {
  Eigen::VectorXd scale;  ///< prior sigmas
  Eigen::MatrixXd basis;  ///< columns span what is estimated, in units of prior sigmas
  std::vector<HeldCombination> held;
  std::vector<ObservableDirection> directions;  ///< of the whole space, best seen first
  Eigen::VectorXd sigma_data;  ///< of each parameter from the data alone; infinite if it shows nothing

  bool estimates(int parameter) const;  ///< false: held by itself
};

/// Holds, one after the other, the worst seen combinations of parameters of one kind, until the data alone
/// know every combination that is left better than its prior does. `information` is Jᵀ W J in the parameters'
/// own units.
EstimableSpace estimable_space(const Eigen::MatrixXd& information, std::span<const Parameter> parameters,
                               const Robot& nominal);

/// (information)⁻¹ within the estimable space, zero outside; in the parameters' own units.
Eigen::MatrixXd constrained_inverse(const Eigen::MatrixXd& information, const EstimableSpace& space);

/// What is known of the parameters without these runs, in their own units: as far as the robot file's
/// calibration covers them by it, else each to its prior_sigma().
Eigen::MatrixXd prior_covariance(std::span<const Parameter> parameters, const Robot& nominal);

/// The covariance of all parameters, in their own units, that comes from what is held: it is as wrong as
/// nominal is, and takes along what is estimated with it. D P Dᵀ with D = C − B (Bᵀ N B)⁻¹ Bᵀ N C: C what is
/// held, B what is estimated, N the information, P the prior covariance of C. Without what is anybody's
/// choice, the robot's own axes.
Eigen::MatrixXd held_covariance(const Eigen::MatrixXd& information, const EstimableSpace& space,
                                std::span<const Parameter> parameters, const Robot& nominal);

/// What cannot be determined, and what to drive. `measures_length`: runs were measured in metres from
/// outside.
struct HeldWords {
  std::string names;
  std::string advice;
};
HeldWords reason_for(const HeldCombination& held, std::span<const Parameter> parameters, const Robot& nominal,
                     bool measures_length);
/// The same as one sentence, with what is done.
std::string words_for(const HeldCombination& held, std::span<const Parameter> parameters,
                      const Robot& nominal, bool measures_length);

}  // namespace trundle::calibration
