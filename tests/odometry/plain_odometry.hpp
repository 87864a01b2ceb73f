#pragma once

#include <cmath>
#include <span>
#include <vector>

#include <Eigen/Dense>

#include "trundle/chassis/robot.hpp"
#include "trundle/chassis/rows.hpp"

namespace trundle::test {
using namespace odometry;

/// docs/theory/odometry.md written down as it stands there, with nothing prepared: weighted least squares row
/// by row, and every source of noise as a column of its own that is carried along.
class PlainOdometry {
 public:
  /// `weights`: of the chassis as it is believed to be, where `robot` differs from it a little.
  PlainOdometry(const Robot& robot, const Chassis& weights, const Pose2& start = {})
      : chassis_(robot.chassis), weights_(weights), pose_(start) {}

  void step(const Increment& increment) {
    const Rows rows = rows_at(chassis_, increment, increment.has_gyro);
    const RowMatrix H = rows.H;
    const RowVector W = weights_of(rows, increment).cwiseInverse();
    const Eigen::MatrixXd N = H.transpose() * W.asDiagonal() * H;
    const Eigen::MatrixXd G = N.inverse() * H.transpose() * W.asDiagonal();
    const Twist2 twist = Twist2::from(G * readings_of(chassis_, rows, increment).z);
    RowVector variance = variances_of(rows, increment);
    add_misread_steering(rows, increment, twist, variance);
    carry(G, variance, increment, twist);
    pose_ = pose_ * exp(twist);
  }
  const Pose2& pose() const { return pose_; }
  /// Of (x, y, heading) in world axes.
  Matrix3 covariance() const {
    Matrix3 sum = Matrix3::Zero();
    for (const Vector3& source : sources_) sum += source * source.transpose();
    for (const Vector3& source : last_counts_) sum += source * source.transpose();
    Matrix3 R = Matrix3::Identity();
    R.topLeftCorner<2, 2>() = rotation(pose_.heading);
    return R * sum * R.transpose();
  }
  void start_with(const Matrix3& covariance_in_body) {
    const Matrix3 L = covariance_in_body.llt().matrixL();
    for (int i = 0; i < 3; ++i) sources_.emplace_back(L.col(i));
  }

 private:
  /// Eq. 2a, and what slips weighs less where weights count.
  RowVector weights_of(const Rows& rows, const Increment& increment) const {
    const bool cancels = !(chassis_.gyro && increment.has_gyro) && !slips(increment);
    const double speed = slowest_speed() * (cancels ? 1.0 : std::pow(2.0, octave_));
    RowVector variance = weighing_variances(weights_, rows, speed, 1.0);
    if (rows.count() > 3 && slips(increment)) {
      variance *= increment.duration_s;
      for (int i = 0; i < rows.count(); ++i) variance[i] += turns(rows, i) ? 1e-18 : 1e-12;
      add_slip(rows, increment, variance);
    }
    return variance;
  }

  /// Of what is read; of a steered wheel that it does not skid sideways, too.
  void add_slip(const Rows& rows, const Increment& increment, RowVector& variance) const {
    for (int i = 0; i < inputs(); ++i) variance[i] += increment.slip_variance[static_cast<std::size_t>(i)];
    for (int i = rows.measured; i < rows.count(); ++i) {
      const int index = rows.row[static_cast<std::size_t>(i)].wheel;
      if (index >= 0 && wheel(index).steering)
        variance[i] += increment.slip_variance[static_cast<std::size_t>(index)];
    }
  }

  /// Of the readings by themselves: the ways that became sure (eq. 9), and no rounding.
  RowVector variances_of(const Rows& rows, const Increment& increment) {
    Increment sure{.duration_s = increment.duration_s, .has_gyro = increment.has_gyro};
    double travel_m = 0.0;
    for (int i = 0; i < inputs(); ++i) {
      const auto k = static_cast<std::size_t>(i);
      pending_[k] += increment.turned[k];
      if (std::abs(pending_[k]) < grain_of(i)) continue;
      sure.turned[k] = std::abs(pending_[k]);
      travel_m += travel_of(i) * sure.turned[k];
      pending_[k] = 0.0;
    }
    const double dt = increment.duration_s;
    speed_ += dt / (1.0 + dt) * (travel_m / dt - speed_);
    const double middle = slowest_speed() * std::pow(2.0, octave_);
    if (speed_ > 2.0 * middle || speed_ < 0.5 * middle)
      octave_ = std::clamp(std::round(std::log2(speed_ / slowest_speed())), 0.0, 11.0);
    RowVector variance = readings_of(chassis_, rows, sure).variance;
    for (int i = 0; i < inputs() && chassis_.wheel_count > 0; ++i)
      variance[i] -= 2.0 * rounding_variance(wheel(i));
    add_slip(rows, increment, variance);
    return variance;
  }

  /// Eq. 12.
  void add_misread_steering(const Rows& rows, const Increment& increment, const Twist2& twist,
                            RowVector& variance) const {
    const Chassis standing = at_steering(chassis_, increment);
    for (int i = rows.measured; i < rows.count(); ++i) {
      const int index = rows.row[static_cast<std::size_t>(i)].wheel;
      if (index < 0 || !standing.wheel_storage[static_cast<std::size_t>(index)].steering) continue;
      const Wheel& steered = standing.wheel_storage[static_cast<std::size_t>(index)];
      const double sigma = steered.steering->scale * steered.steering->sigma_rad;
      variance[i] += std::pow(sigma * rolling_row(steered).dot(twist.vector()), 2);
    }
  }

  /// Eq. 10 without its bookkeeping: each count's rounding is a source, entered when it falls, left when the
  /// next one does.
  void carry(const Eigen::MatrixXd& G, const RowVector& variance, const Increment& increment,
             const Twist2& twist) {
    const Matrix3 Ad = adjoint(exp(twist).inverse());
    const Matrix3 Jr = right_jacobian(twist);
    for (Vector3& source : sources_) source = Ad * source;
    for (Vector3& source : last_counts_) source = Ad * source;
    for (int i = 0; i < variance.size(); ++i) sources_.emplace_back(std::sqrt(variance[i]) * Jr * G.col(i));
    last_counts_.resize(static_cast<std::size_t>(chassis_.wheel_count), Vector3::Zero());
    for (int i = 0; i < chassis_.wheel_count; ++i) {
      const auto k = static_cast<std::size_t>(i);
      if (increment.turned[k] == 0.0) continue;
      const Vector3 now = std::sqrt(rounding_variance(wheel(i))) * Jr * G.col(i);
      sources_.emplace_back(last_counts_[k] - now);
      last_counts_[k] = now;
    }
  }

  static bool turns(const Rows& rows, int i) {
    const RowKind kind = rows.row[static_cast<std::size_t>(i)].kind;
    return kind == RowKind::gyro || kind == RowKind::turn;
  }
  int inputs() const { return chassis_.wheel_count > 0 ? chassis_.wheel_count : 2; }
  const Wheel& wheel(int i) const { return chassis_.wheel_storage[static_cast<std::size_t>(i)]; }
  bool slips(const Increment& increment) const {
    return std::ranges::any_of(increment.slip_variance, [](double v) { return v > 0.0; });
  }
  double grain_of(int i) const {
    const ChassisNoise& noise = chassis_.noise;
    if (chassis_.wheel_count == 0)
      return 4.0 * std::pow(i == 0 ? noise.wheel_per_sqrt_m : noise.turn_per_sqrt_rad, 2);
    const double ticks = std::abs(wheel(i).ticks_per_revolution);
    return 4.0 * std::pow(wheel_noise(chassis_, static_cast<std::size_t>(i)), 2) /
               (kPi * wheel(i).diameter_m) +
           (ticks > 0.0 ? 2.0 / ticks : 0.0);
  }
  double travel_of(int i) const {
    if (chassis_.wheel_count > 0) return kPi * wheel(i).diameter_m / chassis_.wheel_count;
    const double by_travel = std::pow(chassis_.noise.turn_per_sqrt_m, 2);
    const double by_turn = std::pow(chassis_.noise.turn_per_sqrt_rad, 2);
    return (i == 0 ? by_travel : by_turn) / (by_travel + by_turn);
  }
  double slowest_speed() const {
    double grain_m = chassis_.wheel_count == 0 ? grain_of(0) : 0.0;
    for (int i = 0; i < chassis_.wheel_count; ++i)
      grain_m = std::max(grain_m, grain_of(i) * kPi * wheel(i).diameter_m);
    return std::max(0.01, 2.0 * grain_m);
  }

  Chassis chassis_;
  Chassis weights_;
  Pose2 pose_;
  std::array<double, kMaxWheels> pending_{};
  double speed_ = 0.0;
  double octave_ = 0.0;
  std::vector<Vector3> sources_;      ///< in body axes, times their sigmas
  std::vector<Vector3> last_counts_;  ///< of each wheel
};

inline Pose2 plainly_integrated(const Robot& robot, const Chassis& weights,
                                std::span<const Increment> increments, Pose2 pose = {}) {
  PlainOdometry odometry(robot, weights, pose);
  for (const Increment& increment : increments) odometry.step(increment);
  return odometry.pose();
}

}  // namespace trundle::test
