#pragma once

#include "trundle/chassis/rows.hpp"

namespace trundle::chassis {

// Steered wheels with an encoder as what they are in the axes of the body: such a wheel says how far its
// contact point moved, forward and to the left. Those two rows of H are the same however it is steered, so
// that readings of many intervals may be added up. docs/theory/chassis.md, eq. 11.

/// Whether some wheel with an encoder is steered.
[[nodiscard]] bool has_steered_encoders(const Chassis& chassis);

/// The rows that check each other. Of a chassis without steered encoders those that are measured, and none of
/// passive wheels that are steered. Of one with them every row, those of steered wheels in the axes of the
/// body: that a wheel does not skid sideways is what makes its angle a reading.
[[nodiscard]] Rows checking_rows(const Chassis& chassis, bool with_gyro);

/// Displacement of a contact point in the axes of the body, summed over intervals, and the covariance of its
/// noise. A count that is rounded up in one interval is missing in the next, along the wheel's direction in
/// each: what is left of it where the wheel is steered in between counts, that of the last reading does not.
/// docs/theory/slip-detection.md, eq. 6a.
struct ContactMotion {
  double x_m = 0.0;
  double y_m = 0.0;
  double variance_xx = 0.0;  ///< [m²]
  double variance_xy = 0.0;
  double variance_yy = 0.0;
  double last_x = 0.0, last_y = 0.0;  ///< direction in the last interval in which it rolled

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.x_m, self.y_m, self.variance_xx, self.variance_xy, self.variance_yy, self.last_x,
            self.last_y);
  }
};
/// Of each wheel with an encoder; nothing of those that are not steered.
using ContactMotions = std::array<ContactMotion, kMaxWheels>;

/// Adds what steered wheels read in one more interval.
void add_interval(const Chassis& chassis, const Increment& increment, ContactMotions& contacts);

/// Variance of a lateral row of a steered wheel that comes from its angle, where it rolls `travel_m` along
/// its direction: misread by δψ, the row n turns by −d. docs/theory/odometry.md, eq. 12.
[[nodiscard]] double misreading_variance(const Wheel& wheel, double travel_m);
/// Of each row is_of_angle() in this motion; 0 of all others.
[[nodiscard]] RowVector misreading_variances(const Chassis& chassis, const Rows& rows, const Vector3& motion);

}  // namespace trundle::chassis
