#pragma once

#include <vector>

#include <Eigen/Core>

#include "trundle/namespaces.hpp"

namespace trundle::calibration {

/// Gaussian information about the parameters from one group of independent residuals: with residual ν,
/// Jacobian J = −∂ν/∂p and weight W = cov(ν)⁻¹.
struct Information {
  Eigen::MatrixXd matrix;    ///< Jᵀ W J
  Eigen::VectorXd gradient;  ///< Jᵀ W ν: zero at the optimum, covariance `matrix` under the model
  double chi2 = 0.0;         ///< νᵀ W ν
  int count = 0;             ///< scalar residuals

  static Information zero(Eigen::Index parameters) {
    return {Eigen::MatrixXd::Zero(parameters, parameters), Eigen::VectorXd::Zero(parameters), 0.0, 0};
  }

  template <class Jacobian, class Weight, class Residual>
  void add(const Jacobian& J, const Weight& W, const Residual& nu) {
    const auto JtW = (J.transpose() * W).eval();
    matrix.noalias() += JtW * J;
    gradient.noalias() += JtW * nu;
    chi2 += nu.dot(W * nu);
    count += static_cast<int>(nu.size());
  }

  /// The same with all weights scaled.
  void add(const Information& other, double weight = 1.0) {
    matrix += weight * other.matrix;
    gradient += weight * other.gradient;
    chi2 += weight * other.chi2;
    count += other.count;
  }
};

/// Adds a residual; one beyond the gate teaches nothing and costs no more than the gate. Returns whether it
/// counted.
template <class Jacobian, class Weight, class Residual>
bool add_within(Information& information, const Jacobian& J, const Weight& W, const Residual& nu,
                double gate) {
  if (nu.dot(W * nu) > gate) {
    information.chi2 += gate;
    return false;
  }
  information.add(J, W, nu);
  return true;
}

}  // namespace trundle::calibration
