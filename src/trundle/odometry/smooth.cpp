#include "trundle/odometry/smooth.hpp"

#include <Eigen/Cholesky>

#include "trundle/geometry/decompositions.hpp"

namespace trundle::odometry {
namespace {

using Vector4 = Eigen::Vector4d;
using Matrix4 = Eigen::Matrix4d;

Matrix4 covariance_of(const FilteredStep& step) {
  Matrix4 P;
  P.topLeftCorner<3, 3>() = full_matrix(step.white);
  P.topRightCorner<3, 1>() = Eigen::Map<const Vector3>(step.bias.data());
  P.bottomLeftCorner<1, 3>() = P.topRightCorner<3, 1>().transpose();
  P(3, 3) = step.gyro_bias.variance;
  return P;
}

/// How the state before a step enters the one after it.
Matrix4 transition_of(const StepTrace& trace) {
  Matrix4 A = Matrix4::Identity();
  A(0, 2) = -trace.displacement[1];
  A(1, 2) = trace.displacement[0];
  A.topRightCorner<3, 1>() = Eigen::Map<const Vector3>(trace.by_bias.data());
  return A;
}

void change_by(const Vector4& change, FilteredStep& step) {
  step.pose = {step.pose.x + change[0], step.pose.y + change[1], step.pose.heading + change[2]};
  step.gyro_bias.rad_s += change[3];
}

/// What the filter would have found from another bias at the start, to first order.
void start_from(double change_rad_s, std::vector<FilteredStep>& steps) {
  Vector4 change(0.0, 0.0, 0.0, change_rad_s);
  for (std::size_t k = 0; k < steps.size(); ++k) {
    StepTrace& trace = steps[k].trace;
    if (k > 0) {
      change = transition_of(trace) * change;
      if (trace.innovation_variance > 0.0) {
        trace.innovation -= change[3];
        change -= Eigen::Map<const Vector4>(trace.gain.data()) * change[3];
      }
    }
    change_by(change, steps[k]);
  }
}

/// What is still to be learned after a step, as a change of its estimate: x − P λ, P − P Λ P.
struct Adjoint {
  Vector4 lambda = Vector4::Zero();
  Matrix4 Lambda = Matrix4::Zero();
};

/// docs/theory/gyro.md, eq. 7
void back_through_update(Adjoint& adjoint, const StepTrace& trace) {
  if (trace.innovation_variance <= 0.0) return;
  Matrix4 C = Matrix4::Identity();  // I − K H, H = (0 0 0 1)
  C.col(3) -= Eigen::Map<const Vector4>(trace.gain.data());
  adjoint.lambda = C.transpose() * adjoint.lambda;
  adjoint.Lambda = C.transpose() * adjoint.Lambda * C;
  adjoint.lambda[3] -= trace.innovation / trace.innovation_variance;
  adjoint.Lambda(3, 3) += 1.0 / trace.innovation_variance;
}

void back_through_motion(Adjoint& adjoint, const StepTrace& trace) {
  const Matrix4 A = transition_of(trace);
  adjoint.lambda = A.transpose() * adjoint.lambda;
  adjoint.Lambda = A.transpose() * adjoint.Lambda * A;
}

/// P − P Λ P as L (I − Lᵀ Λ L) Lᵀ with P = L Lᵀ: what is much surer afterwards is no difference of large
/// numbers, and no variance comes out below 0.
Matrix4 smoothed_covariance(const Matrix4& P, const Matrix4& Lambda) {
  const Eigen::LDLT<Matrix4> factor(P);
  const Vector4 root = factor.vectorD().cwiseMax(0.0).cwiseSqrt();
  const Matrix4 L =
      factor.transpositionsP().transpose() * Matrix4(Matrix4(factor.matrixL()) * root.asDiagonal());
  const SymmetricEigen learned = symmetric_eigen(Matrix4(L.transpose() * Lambda * L));
  const Vector4 left = (1.0 - learned.values.array()).cwiseMax(0.0).sqrt();
  const Matrix4 smoothed_root = L * Matrix4(learned.vectors) * left.asDiagonal();
  return smoothed_root * smoothed_root.transpose();
}

/// docs/theory/gyro.md, eq. 8
void apply(const Adjoint& adjoint, FilteredStep& step) {
  const Matrix4 P = covariance_of(step);
  const Vector4 change = P * adjoint.lambda;
  const Matrix4 smoothed = adjoint.Lambda.isZero(0.0) ? P : smoothed_covariance(P, adjoint.Lambda);
  change_by(-change, step);
  step.gyro_bias.variance = smoothed(3, 3);
  step.white = symmetric_of(smoothed.topLeftCorner<3, 3>());
  Eigen::Map<Vector3>(step.bias.data()) = smoothed.topRightCorner<3, 1>();
}

}  // namespace

FilteredStep filtered_step(const Odometer& odometer) {
  const OdometerState& state = odometer.state();
  return {state.pose, odometer.white(), state.bias, odometer.gyro_bias(), odometer.trace()};
}

void smooth(std::vector<FilteredStep>& steps, double prior_rad_s) {
  start_from(prior_rad_s, steps);
  Adjoint adjoint;
  for (auto step = steps.rbegin(); step != steps.rend(); ++step) {
    const StepTrace trace = step->trace;
    apply(adjoint, *step);
    back_through_update(adjoint, trace);
    back_through_motion(adjoint, trace);
  }
}

}  // namespace trundle::odometry
