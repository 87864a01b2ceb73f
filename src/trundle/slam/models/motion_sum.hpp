#pragma once

#include <optional>

#include "trundle/odometry/odometer.hpp"
#include "trundle/odometry/persist.hpp"
#include "trundle/slam/steps.hpp"

namespace trundle::slam {

/// Composes increments to the motion of one step, all of them about the robot file's bias: what the odometer
/// has learned at rest only shows it where the robot rests, and where an arc bends.
class MotionSum {
 public:
  MotionSum(const Robot& robot, const SlamInputOptions& options, const SystematicErrors& systematic);

  void add(const Increment& increment, bool bridged);
  /// The motion since finish_step, with the rounding of the last counts.
  [[nodiscard]] Motion so_far() const;
  /// Appends the motion since the last call, and what was seen at its end, to come.
  void finish_step(double time_s, SlamInput& input);
  [[nodiscard]] double rest_s() const { return rest_s_; }

  /// Its state, for io/archive.hpp; of parameters nothing is stored.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    odometry::persist_odometer(archive, self.odometer_);
    archive(self.sum_, self.counted_, self.reading_, self.rest_s_);
  }

 private:
  void begin_interval();
  Matrix3 count_pending();
  [[nodiscard]] GyroBias learned() const;
  [[nodiscard]] Motion motion_of_interval(const GyroBias& before, double duration_s) const;
  void add_by_bias(const GyroBias& before, double duration_s, Motion& motion) const;
  void add_reading(const GyroBias& before);

  bool learns_;
  Odometer odometer_;
  SystematicErrors systematic_;
  double walk_;  ///< of the gyro's bias [rad²/s³]
  Motion sum_;
  bool counted_ = false;  ///< counts fell since the last step
  std::optional<BiasReading> reading_;
  Eigen::Matrix3Xd by_parameters_;
  std::optional<calibration::SensitivityErrors> reading_errors_;  ///< where there are parameters
  double rest_s_ = 0.0;
};

}  // namespace trundle::slam
