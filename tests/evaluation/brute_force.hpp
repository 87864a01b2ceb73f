#pragma once

#include <limits>
#include <vector>

#include <Eigen/Dense>
#include <unsupported/Eigen/MatrixFunctions>

#include "trundle/geometry/trajectory.hpp"

/// The measures of evaluate() a second time, from their definitions: homogeneous matrices, matrix logarithms,
/// numeric minimisation, every pair of poses. Slow and simple.
namespace trundle::test::brute_force {
using namespace evaluation;

struct Sample {
  double time_s;
  Eigen::Matrix3d estimate;
  Eigen::Matrix3d reference;
};

inline Eigen::Matrix3d matrix_of(const Pose2& pose) {
  Eigen::Matrix3d T;
  T << std::cos(pose.heading), -std::sin(pose.heading), pose.x,  //
      std::sin(pose.heading), std::cos(pose.heading), pose.y,    //
      0.0, 0.0, 1.0;
  return T;
}

inline double angle_of(const Eigen::Matrix3d& T) {
  return std::atan2(T(1, 0), T(0, 0));
}
inline Eigen::Vector2d position_of(const Eigen::Matrix3d& T) {
  return T.topRightCorner<2, 1>();
}

inline std::vector<Sample> samples(const Trajectory& estimate, const Trajectory& reference,
                                   double longest_gap_s) {
  std::vector<Sample> result;
  for (const StampedPose& truth : reference.poses) {
    for (std::size_t i = 0; i < estimate.poses.size(); ++i) {
      const StampedPose& a = estimate.poses[i];
      if (a.time_s == truth.time_s) {
        result.push_back({truth.time_s, matrix_of(a.pose), matrix_of(truth.pose)});
        break;
      }
      if (i + 1 == estimate.poses.size()) break;
      const StampedPose& b = estimate.poses[i + 1];
      if (a.time_s > truth.time_s || b.time_s <= truth.time_s || b.time_s - a.time_s > longest_gap_s)
        continue;
      const Eigen::Matrix3d step = matrix_of(a.pose).inverse() * matrix_of(b.pose);
      const Eigen::Matrix3d part = (truth.time_s - a.time_s) / (b.time_s - a.time_s) * step.log();
      result.push_back({truth.time_s, matrix_of(a.pose) * part.exp(), matrix_of(truth.pose)});
      break;
    }
  }
  return result;
}

/// Σ |p_reference − T p_estimate|² for a rotation, with the best shift for it.
inline double cost(const std::vector<Sample>& all, double angle, Eigen::Vector2d* best_shift = nullptr) {
  const Eigen::Rotation2Dd R(angle);
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();
  for (const Sample& s : all)
    shift += (position_of(s.reference) - R * position_of(s.estimate)) / static_cast<double>(all.size());
  double sum = 0.0;
  for (const Sample& s : all)
    sum += (position_of(s.reference) - R * position_of(s.estimate) - shift).squaredNorm();
  if (best_shift != nullptr) *best_shift = shift;
  return sum;
}

/// By a grid over all rotations, refined three times tenfold, then a parabola through the last three points.
inline Eigen::Matrix3d align_se2(const std::vector<Sample>& all) {
  double best = 0.0;
  double width = 3.2;
  for (int level = 0; level < 5; ++level) {
    double best_cost = std::numeric_limits<double>::infinity();
    const double middle = best;
    for (int i = -200; i <= 200; ++i) {
      const double angle = middle + width * i / 200.0;
      if (const double c = cost(all, angle); c < best_cost) best_cost = c, best = angle;
    }
    width /= 50.0;
  }
  constexpr double h = 1e-3;
  const double left = cost(all, best - h), middle = cost(all, best), right = cost(all, best + h);
  best -= 0.5 * h * (right - left) / (right - 2.0 * middle + left);
  Eigen::Vector2d shift;
  cost(all, best, &shift);
  Eigen::Matrix3d T = matrix_of({0.0, 0.0, best});
  T.topRightCorner<2, 1>() = shift;
  return T;
}

struct Relative {
  double translation_rms_m = 0.0;
  double heading_rms_rad = 0.0;
  double translation_mean_percent = 0.0;
  std::size_t pairs = 0;
};

/// Way between two samples: steps of the reference, noise below `step_m` left out, counted from the first
/// sample.
inline double way(const std::vector<Sample>& all, std::size_t to, double step_m) {
  double sum = 0.0;
  std::size_t anchor = 0;
  for (std::size_t i = 1; i <= to; ++i) {
    const double step = (position_of(all[i].reference) - position_of(all[anchor].reference)).norm();
    if (step >= step_m) sum += step, anchor = i;
  }
  return sum;
}

inline Relative relative(const std::vector<Sample>& all, double distance_m, double step_m) {
  Relative result;
  double translation2 = 0.0, heading2 = 0.0, percent = 0.0;
  std::vector<double> driven_to;
  for (std::size_t i = 0; i < all.size(); ++i) driven_to.push_back(way(all, i, step_m));
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (std::size_t j = i; j < all.size(); ++j) {
      const double driven = driven_to[j] - driven_to[i];
      if (driven < distance_m) continue;
      const Eigen::Matrix3d truth = all[i].reference.inverse() * all[j].reference;
      const Eigen::Matrix3d error = truth.inverse() * all[i].estimate.inverse() * all[j].estimate;
      translation2 += position_of(error).squaredNorm();
      heading2 += angle_of(error) * angle_of(error);
      percent += 100.0 * position_of(error).norm() / driven;
      ++result.pairs;
      break;
    }
  }
  const auto n = static_cast<double>(result.pairs);
  result.translation_rms_m = std::sqrt(translation2 / n);
  result.heading_rms_rad = std::sqrt(heading2 / n);
  result.translation_mean_percent = percent / n;
  return result;
}

}  // namespace trundle::test::brute_force
