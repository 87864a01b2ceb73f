#pragma once

#include <span>
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
  /// What errors of J alone make of `matrix`, in the mean; none: J is exact.
  Eigen::MatrixXd of_noise = {};

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
    add_noise(other.of_noise, weight);
  }
  void add_noise(const Eigen::MatrixXd& more, double weight = 1.0) {
    if (more.size() == 0) return;
    if (of_noise.size() == 0) of_noise.setZero(matrix.rows(), matrix.cols());
    of_noise.topLeftCorner(more.rows(), more.cols()) += weight * more;
  }
};

/// K = (A − B) A⁺ for information A of which B is made by noise: of all that was summed, K A Kᵀ is known of
/// the parameters, and K times the gradient says it. What B has beyond A is chance.
/// docs/theory/calibration-redundancy.md, eq. 7c.
[[nodiscard]] Eigen::MatrixXd share_known(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);
/// Takes out of the blocks what noise makes of all of them together.
void keep_what_is_known(std::span<Information> blocks);
/// Weight and covariance of a residual's Jacobian: what that makes of JᵀWJ. The covariance has J's columns,
/// each as long as the residual, one below the other.
[[nodiscard]] Eigen::MatrixXd information_of_noise(const Eigen::MatrixXd& W,
                                                   const Eigen::MatrixXd& covariance);

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
