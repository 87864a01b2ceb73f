#pragma once

#include <array>
#include <optional>
#include <vector>

#include "trundle/recording/alignment/align.hpp"

namespace trundle::odometry {

struct EffectiveTrackOptions {
  double window_s = 0.5;  ///< readings are summed over this time
  double memory_rad =
      12.0;             ///< turning after which a window counts 1/e: without turning nothing is forgotten
  double alarm = 12.0;  ///< limit of the cumulative sum of normalised innovations
  double slack = 0.75;  ///< taken off each of them [σ]
};

/// All that changes: plain numbers, to be copied and stored.
struct EffectiveTrackState {
  std::array<double, 3> normal{};     ///< Σ λ w x xᵀ of x = (turn, duration): entries 00, 01, 11
  std::array<double, 3> scatter{};    ///< Σ λ² w x xᵀ
  std::array<double, 2> right{};      ///< Σ λ w x d
  double squares = 0.0, count = 0.0;  ///< of normalised innovations
  double above = 0.0, below = 0.0;    ///< cumulative sums
  double difference_m = 0.0, turn_rad = 0.0, duration_s = 0.0, path_m = 0.0;  ///< of the window being filled
  double turned_rad = 0.0;                                                    ///< since the last alarm
};

/// The track that makes the wheels' turns those of the gyro, as the ground has it now: d = b·g + c·duration
/// with d how much further the right wheels rolled, g the gyro's turn and c what its bias makes. Recursive
/// least squares that forgets as the robot turns. docs/theory/effective-track.md. One step takes bounded time
/// and never allocates.
class EffectiveTrack {
 public:
  /// Whether a chassis has wheels on two sides that roll ahead, and a gyro.
  [[nodiscard]] static bool applies_to(const Chassis& chassis);

  /// Throws CannotAnswer where it does not apply.
  explicit EffectiveTrack(const Chassis& chassis, const EffectiveTrackOptions& options = {});

  /// Returns true when the track has just left the interval that it was known to be in: the ground has
  /// changed, or a wheel slips. What was learned before is then forgotten.
  bool step(const Increment& increment);

  /// [m]; nothing before the robot has turned enough.
  [[nodiscard]] std::optional<double> track_m() const;
  /// 1σ of it [m], from the scatter of the windows.
  [[nodiscard]] double sigma_m() const;

  [[nodiscard]] const EffectiveTrackState& state() const { return state_; }
  void resume(const EffectiveTrackState& state) { state_ = state; }

 private:
  struct Solution {
    double track_m, drift_m_s;
    double variance;  ///< of the track, for windows of unit scatter
  };
  Solution solve() const;
  double scatter() const;
  double window_variance() const;
  bool finish_window();
  bool leaves(double innovation, double variance);
  void learn(double weight);

  Chassis chassis_;
  EffectiveTrackOptions options_;
  double nominal_m_ = 0.0;
  int left_ = 0;
  int right_ = 0;
  EffectiveTrackState state_;
};

/// One stretch of ground: between two alarms.
struct TrackOnGround {
  double start_s = 0.0;
  double end_s = 0.0;
  double track_m = 0.0;
  double sigma_m = 0.0;
};

/// The effective track along a recording, one entry for each stretch on which the robot turned enough.
[[nodiscard]] std::vector<TrackOnGround> effective_tracks(const AlignedReadings& readings,
                                                          const Chassis& chassis,
                                                          const EffectiveTrackOptions& options = {});
/// The same of a recording whose robot EffectiveTrack applies to, reading by reading. Throws as align() does.
[[nodiscard]] std::vector<TrackOnGround> effective_tracks(const Recording& recording, const Robot& robot);

}  // namespace trundle::odometry
