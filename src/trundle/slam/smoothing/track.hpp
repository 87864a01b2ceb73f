#pragma once

#include <map>
#include <optional>
#include <span>

#include "trundle/geometry/trajectory.hpp"
#include "trundle/slam/report.hpp"
#include "trundle/slam/smoothing/solver/minimise.hpp"
#include "trundle/slam/steps.hpp"

namespace trundle::slam {

/// The motion of each step of a recording, and which landmark each of its observations shows
/// (kUnknownLandmark: leave it out).
struct TrackInput {
  std::vector<double> time_s = {};
  std::vector<FreeMotion> motions = {};
  std::vector<std::vector<Observation>> observations = {};
  KnownStart start = {};
  Matrix3 start_covariance = Matrix3::Zero();                  ///< of (x, y, heading) in world axes
  std::vector<std::optional<BiasReading>> bias_readings = {};  ///< by step; none: there are none
  std::vector<std::size_t> also_keyframes = {};  ///< steps, in order, at which a robot was seen, or sees one
  int sensor = 0;                                ///< of the problem
};

/// 1 σ of the start of a track of which nobody knows where it starts: beyond any place that robots meet in,
/// and any turn.
inline constexpr double kFreeStart_m = 1e3;
inline constexpr double kFreeStart_rad = 1e2;
[[nodiscard]] inline Matrix3 free_start_covariance() {
  return Vector3(kFreeStart_m * kFreeStart_m, kFreeStart_m * kFreeStart_m, kFreeStart_rad * kFreeStart_rad)
      .asDiagonal();
}

/// The problem's numbers of landmarks, by the caller's.
using LandmarkNumbers = std::map<LandmarkId, int>;

/// A recording as part of a smoothing problem: its keyframes, the steps at which something was seen, or the
/// bias read, are poses of the problem; all other steps lie between two of them, and follow from them.
class Track {
 public:
  /// Appends keyframes, links and those landmarks to the problem that have no number yet: the others are seen
  /// from tracks before it too.
  Track(const TrackInput& input, SmoothingProblem& problem, LandmarkNumbers& numbers);

  [[nodiscard]] std::size_t keyframes() const { return keyframe_steps_.size(); }
  /// Its poses of a trajectory that has one for each step.
  [[nodiscard]] Trajectory at_keyframes(const Trajectory& trajectory) const;
  [[nodiscard]] double time_of(std::size_t keyframe) const { return time_s_[keyframe_steps_[keyframe]]; }
  /// The motion up to a keyframe from the one before it.
  [[nodiscard]] const FreeMotion& motion_to(std::size_t keyframe) const {
    return since_[keyframe_steps_[keyframe]];
  }
  /// The problem's pose at a step that is a keyframe.
  [[nodiscard]] int pose_at(std::size_t step) const {
    return first_pose_ + static_cast<int>(next_keyframe_[step]);
  }
  /// The caller's numbers of the landmarks that no track before it saw, as the problem's from
  /// first_landmark() on.
  [[nodiscard]] std::span<const LandmarkId> landmarks() const { return landmarks_; }
  [[nodiscard]] int first_pose() const { return first_pose_; }
  [[nodiscard]] int first_landmark() const { return first_landmark_; }

  /// All steps at a state at which the problem was linearised, with covariances. docs/theory/smoother.md,
  /// eq. 12.
  [[nodiscard]] Trajectory trajectory(const SmoothingState& state, const Minimiser& linearised) const;
  /// The bias at the keyframe that ends each step, or at the last one; none where there is none.
  [[nodiscard]] std::vector<BiasEstimate> biases(const SmoothingState& state,
                                                 const Minimiser& linearised) const;

 private:
  [[nodiscard]] GaussianPose at(std::size_t step, const SmoothingState& state,
                                const Minimiser& linearised) const;

  std::vector<double> time_s_;
  KnownStart start_;
  std::vector<FreeMotion> since_;           ///< by step: since the keyframe before it
  std::vector<std::size_t> next_keyframe_;  ///< by step: the keyframe at or after it
  std::vector<std::size_t> keyframe_steps_;
  std::vector<LandmarkId> landmarks_;
  int first_pose_;
  int first_landmark_;
};

}  // namespace trundle::slam
