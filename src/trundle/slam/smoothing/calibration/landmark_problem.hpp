#pragma once

#include <span>
#include <vector>

#include "trundle/calibration/problem/bias_walk.hpp"
#include "trundle/calibration/problem/run.hpp"
#include "trundle/chassis/parameter.hpp"
#include "trundle/recording/recording.hpp"
#include "trundle/slam/smoothing/calibration/own_biases.hpp"
#include "trundle/slam/smoothing/shown.hpp"
#include "trundle/slam/smoothing/track.hpp"

namespace trundle::slam {

/// A recording whose sightings are associated with landmarks.
struct AssociatedRecording {
  const Recording& recording;
  Run run;                        ///< its readings
  bool has_unidentified = false;  ///< some sightings bear no name
  std::vector<LandmarkId> shown;  ///< by each sighting (SlamInput::sighting_numbers)
  Trajectory path;                ///< along which they were associated; none where nothing was seen
  bool in_reference = false;      ///< the path is in the reference's frame, and its positions count

  double start_s() const { return path.poses.empty() ? 0.0 : path.poses.front().time_s; }
  double end_s() const { return path.poses.empty() ? 0.0 : path.poses.back().time_s; }
  double duration_s() const { return end_s() - start_s(); }
};

/// Parameters are sought as those of a robot + columns · q, q about 0 with `information`; with them the
/// gyro's bias of each recording, and how it walks there: behind q come the biases, behind those the walks'
/// harmonics of one recording after the other.
struct FreeColumns {
  Chassis nominal = {};
  std::vector<Parameter> parameters = {};
  Eigen::MatrixXd columns = {};
  Eigen::VectorXd information = {};
  OwnBiases own = {};
  std::vector<BiasWalk> walks = {};  ///< by recording; none: the bias does not walk, or is not sought
  double walk_information = 1.0;     ///< of the prior of each harmonic, as OwnBiases::information
  double position_sigma_m = 0.0;     ///< with which positions by the reference count, where they do

  [[nodiscard]] BiasWalk walk_of(std::size_t recording) const {
    return recording < walks.size() ? walks[recording] : BiasWalk{};
  }
  [[nodiscard]] Eigen::Index first_harmonic(std::size_t recording) const;
  /// How many are sought.
  [[nodiscard]] Eigen::Index count() const { return first_harmonic(walks.size()); }
  /// Where the robot has moved to where it was found, and its bias in each recording: they start from 0
  /// again. Motions know nothing of how it walks, which starts where it was `found`.
  [[nodiscard]] Eigen::VectorXd parameters_from_here(const Eigen::VectorXd& found) const;
  /// Where among the parameters the gyro's bias is, which is one of them.
  [[nodiscard]] Eigen::Index row_of_gyro_bias() const;
};

/// All recordings as one problem; each is a track of its own. Its parameters are those of FreeColumns.
struct JointProblem {
  SmoothingProblem problem;
  std::vector<Track> tracks;
};

/// `with_scatter`: ReadingErrors::scatter of the motions too, for noise_information().
[[nodiscard]] JointProblem joint_problem(std::span<const AssociatedRecording> all, const Robot& robot,
                                         const FreeColumns& free, bool with_scatter = false);

/// Their paths at the keyframes, one after the other.
[[nodiscard]] Trajectory poses_at_keyframes(const JointProblem& joint,
                                            std::span<const AssociatedRecording> all);

}  // namespace trundle::slam
