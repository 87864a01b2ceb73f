#pragma once

#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "trundle/chassis/contact.hpp"
#include "trundle/chassis/robot.hpp"
#include "trundle/odometry/rest.hpp"

namespace trundle::slip {

/// Most directions in which readings can contradict each other: every wheel, steered ones twice, and the
/// gyro, less what moves.
inline constexpr int kMaxParity = 2 * kMaxWheels;
/// A wheel that slips; of a steered one also that it goes sideways.
inline constexpr int kMaxFaults = 2 * kMaxWheels;
using ParityVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxParity, 1>;
using ParityMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxParity, kMaxParity>;
using MotionToParity = Eigen::Matrix<double, Eigen::Dynamic, 3, 0, kMaxParity, 3>;
using FaultDirections = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxParity, kMaxFaults>;
using PerWheel = std::array<double, kMaxWheels>;
using PerFault = std::array<double, kMaxFaults>;

/// What may be wrong, of one wheel at a time.
struct Fault {
  int wheel = 0;
  /// It does not roll where its steering says: it skids that way, or its angle is misread. Else it slips
  /// along its rolling direction.
  bool sideways = false;

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.wheel, self.sideways);
  }
};

/// The faults of a robot: first the slip of each wheel, in their order.
class Faults {
 public:
  Faults() = default;
  explicit Faults(const Chassis& chassis);

  [[nodiscard]] std::size_t size() const { return size_; }
  const Fault& operator[](std::size_t fault) const { return faults_[fault]; }

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.faults_, self.size_);
  }

 private:
  std::array<Fault, kMaxFaults> faults_{};
  std::size_t size_ = 0;
};

/// What is judged at once: readings added up, and what was known when they were complete.
struct JudgedInterval {
  Increment readings;  ///< the angles of steered wheels are the last ones
  GyroBias bias;
  double turn_rate_change_rad_s = 0.0;  ///< from the first of the readings to the last
  /// Of steered wheels, over all that was added up; nothing: one interval, whose angles are in `readings`.
  std::optional<ContactMotions> contacts = {};
};

/// What clean recordings taught of the residuals of a chassis: docs/theory/slip-detection.md, eq. 12 and 13.
struct ResidualModel {
  MotionToParity by_motion;  ///< mean of the residual per unit of twist: what is wrong in the geometry
  ParityMatrix scale;  ///< lower L with L Lᵀ = covariance of the residuals whitened by the robot's noise
  double timing_sigma_s = 0.0;    ///< of the gyro's stamps against the wheels'
  std::size_t samples = 0;        ///< intervals it was learned from
  double interval_s = 0.0;        ///< their length
  double limit = 0.0;             ///< of χ² at the probability it was learned for
  bool empirical = false;         ///< the limit is a quantile of the sample, which is not normal
  bool beyond_sample = false;     ///< and the sample is too small for it: its largest value is used
  double persistent_limit = 0.0;  ///< of the cumulative sums: their theory, or the largest they reached
};

/// One interval as contradiction: all in units of one sigma. docs/theory/slip-detection.md, eq. 6 to 8.
struct Contradiction {
  ParityVector e;           ///< whitened: N(0, I) when nothing slips
  double chi2 = 0.0;        ///< |e|²
  FaultDirections towards;  ///< column i: unit vector in which fault i moves e
  PerFault excess_m{};      ///< along its rolling direction, or to the left of it, were that the fault
  PerFault excess_sigma_m{};
  PerFault score{};   ///< excess / its sigma
  PerFault drift{};   ///< 1σ of the score's mean from the gyro's bias: the same in all intervals
  PerWheel travel{};  ///< of each wheel [m]
  PerWheel travel_sigma{};
  double gyro_rad = 0.0;  ///< less its bias
  double gyro_sigma_rad = 0.0;
  /// A slip is at most so long, where the angle of a steered wheel decides how well it shows [m].
  double longest_slip_m = std::numeric_limits<double>::infinity();
};

/// Faults that residuals do not show.
struct IndistinctFaults {
  std::vector<Fault> unseen;                   ///< leave no residual
  std::vector<std::pair<Fault, Fault>> alike;  ///< leave the same one
};

/// Whether readings check each other.
[[nodiscard]] bool can_show_slip(const Chassis& chassis, bool with_gyro);

/// The slip test's geometry of a robot. Its functions never allocate.
class Parity {
 public:
  /// Throws CannotAnswer where the sensors leave no reading to check the others.
  explicit Parity(const Robot& robot);

  int degrees_of_freedom() const { return static_cast<int>(combinations_.cols()); }
  std::size_t wheels() const { return static_cast<std::size_t>(chassis_.wheel_count); }
  bool uses_gyro() const { return chassis_.gyro.has_value(); }
  /// A wheel with an encoder is steered: rows() are those of checking_rows().
  bool is_steered() const { return is_steered_; }
  const Faults& faults() const { return faults_; }
  /// Whether a fault leaves a residual, at some angle of a steered wheel.
  bool is_checked(const Fault& fault) const;
  const Rows& rows() const { return rows_; }
  const Chassis& chassis() const { return chassis_; }

  /// Where the robot has a gyro the interval must have it. `model`: learned, or none.
  Contradiction contradiction(const JudgedInterval& interval, const ResidualModel* model) const;
  /// y = Pᵀ z and its covariance before any learning, and the twist: for learning.
  struct Raw {
    ParityVector y;
    ParityMatrix covariance;
    Vector3 twist;
    Readings readings;  ///< along the rolling direction of each wheel
    /// Where steered wheels rolled, or point: cosine and sine from the x axis of the body.
    std::array<Eigen::Vector2d, kMaxWheels> direction;
  };
  Raw raw(const JudgedInterval& interval, double timing_sigma_s) const;
  /// While it moves like that, steered wheels along the ways of their contact points.
  IndistinctFaults indistinct_faults(const Twist2& motion) const;
  /// Wheels turn while those rows that stand still see every motion that the sensors see at all.
  bool is_stuck(const Contradiction& c) const;
  /// Sizes of the columns of H, by which geometry errors of so many percent are compared.
  const Vector3& size() const { return size_; }

 private:
  using Solver = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMaxRows>;

  void read_in_body_axes(const JudgedInterval& interval, Raw& raw) const;
  ParityVector direction_of(const Fault& fault, const Raw& raw, double misread_rad) const;
  bool rolls(const Contradiction& c, int wheel) const;

  Chassis chassis_;
  Rows rows_;
  bool is_steered_ = false;
  Faults faults_;
  std::array<int, kMaxWheels> lateral_row_{};  ///< of each steered wheel
  int gyro_row_ = -1;
  Combinations combinations_;  ///< P
  Solver twist_from_readings_;
  Vector3 size_;
  double gyro_scale_ = 1.0;
};

}  // namespace trundle::slip
