#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "trundle/chassis/chassis.hpp"

namespace trundle::odometry {

/// What is known of a gyro's bias: its reading at rest.
struct GyroBias {
  double rad_s = 0.0;
  double variance = 0.0;  ///< [rad²/s²]
};

/// When a robot is said to stand still. docs/theory/gyro.md, eq. 1 to 3a.
struct RestOptions {
  double block_s = 0.5;       ///< wheels and gyro must be still for so long, block after block
  int fewest_intervals = 3;   ///< in a block
  double jitter_ticks = 1.5;  ///< range over which a resting counter may toggle
  double jitter_m = 1e-4;     ///< the same for wheels that give no ticks
  /// A wheel that has not counted for so long stands, however slowly its last counts came: what (3a) asks of
  /// one per second, which is how long two blocks take. 1/(∛2 − 1) = 3.85
  double longest_stop_s = 4.0;
  double sigmas = 4.0;             ///< of every test
  double gyro_noise_factor = 1.5;  ///< a gyro's true noise may be larger than the robot file says by this
  double lag_s = 0.2;          ///< stamps of wheels and gyro may be apart by this when they start and stop
  double stuck_sigmas = 5.0;   ///< of the travel that a dead encoder should have seen
  double shaking_m_s2 = 0.15;  ///< largest rms of the accelerometer about its mean
};

/// The range over which a resting wheel's counter may toggle [m].
double jitter_of(const Wheel& wheel, const RestOptions& options);

enum class RestPhase : std::uint64_t {
  moving,
  settling,  ///< nothing moves, but not yet for long enough to be sure
  resting,
};

/// Sums over the intervals of a block.
struct RestBlock {
  double duration_s = 0.0;
  double intervals = 0.0;
  double gyro_rad = 0.0;
  double gyro_squares = 0.0;  ///< Σ gyro²/duration
  double shaking_squares = 0.0;
  double shaking_intervals = 0.0;
};

/// How fast a wheel counted when it last did.
struct LastCounts {
  double counts = 0.0;    ///< of the last interval in which it counted, with their sign
  double within_s = 0.0;  ///< they fell within so long; 0: a counter that may only have toggled
  double since_s = 0.0;   ///< without a count
};

/// All that a RestDetector remembers: plain numbers.
struct RestState {
  RestPhase phase = RestPhase::moving;
  std::array<double, kMaxWheels> turned{};  ///< since the wheels rest, and its range
  std::array<double, kMaxWheels> low{};
  std::array<double, kMaxWheels> high{};
  std::array<double, kMaxWheels> steering_rad{};  ///< of the last interval, as Increment has it
  RestBlock block;                                ///< the one that is not complete yet
  RestBlock passed;                               ///< the complete one before it
  std::array<LastCounts, kMaxWheels> last{};      ///< these outlive a rest
};

/// What a gyro read while the robot stood still.
struct GyroEvidence {
  double gyro_rad = 0.0;
  double duration_s = 0.0;
};

/// Tells standing still from moving: the wheels do not turn, and the gyro agrees (its mean is that of its
/// bias, its scatter that of its noise), and so does the accelerometer where there is one. A dead encoder is
/// not enough. Its functions never allocate.
class RestDetector {
 public:
  RestDetector(const Chassis& chassis, const RestOptions& options);

  /// Could the robot still rest, or begin to, in this interval? Not before the wheels came to stand.
  bool continues(const RestState& state, const Increment& increment, const GyroBias& bias) const;
  /// Adds an interval that continues. What the gyro read is evidence of its bias one block later, when the
  /// robot is known to have stood still on both sides of it.
  std::optional<GyroEvidence> add(RestState& state, const Increment& increment) const;
  /// Remembers when the wheels counted: to be given every interval, after it was judged.
  void follow_counts(RestState& state, const Increment& increment) const;
  /// Forgets all but when the wheels counted.
  static void leave(RestState& state);
  /// What was read and not yet judged: all of it while settling, the last block and the counters' jitter at
  /// rest. To be integrated when the robot moves on.
  static Increment withheld(const RestState& state, double time_s);
  /// Takes out of what is withheld what the wheels turned before a block of rest was complete: they came to
  /// stand, or a counter toggled. The robot did not turn meanwhile. Nothing while a block is incomplete.
  std::optional<Increment> settled(RestState& state, double time_s) const;

  /// Variance of the gyro's integral per second, as its noise may be [rad²/s].
  double gyro_density() const { return gyro_density_; }

 private:
  RestBlock with(const RestBlock& block, const Increment& increment) const;
  double counts_in(const Increment& increment, std::size_t wheel) const;
  bool wheels_stand(const RestState& state, const Increment& increment) const;
  bool wheels_rest(const RestState& state, const Increment& increment) const;
  bool gyro_rests(double gyro_rad, double duration_s, const GyroBias& bias) const;
  bool scatter_rests(const RestBlock& block) const;
  bool complete(const RestBlock& block) const;

  RestOptions options_;
  std::size_t wheels_ = 0;
  std::array<double, kMaxWheels> jitter_{};  ///< in units of Increment::turned
  std::array<double, kMaxWheels> count_{};   ///< the same of one count; 0: what says nothing of a stop
  bool has_gyro_ = false;
  double gyro_density_ = 0.0;  ///< variance of the gyro's integral per second
};

}  // namespace trundle::odometry
