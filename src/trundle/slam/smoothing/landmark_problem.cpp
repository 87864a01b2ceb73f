#include "trundle/slam/smoothing/landmark_problem.hpp"

#include "trundle/calibration/chassis_likelihood.hpp"
#include "trundle/calibration/noise/noise_levels.hpp"
#include "trundle/slam/smoothing/smoother.hpp"

namespace trundle::slam {
namespace {

// A window of readings whose parity residual chance makes once in 10⁶ is slip.
constexpr double kParityGate = 30.0;

/// Unknowns that are no parameters of the robot: of a velocity stream what a robot file does not have.
Eigen::Index shares_of(const Robot& robot) {
  return robot.chassis.wheel_count == 0 ? kShares : 0;
}

TrackInput track_input(const AssociatedRecording& one, const Robot& robot, const FreeColumns& free) {
  const SlamInput input =
      slam_input(one.recording, robot, {.parameters = free.parameters, .shares = shares_of(robot) > 0});
  const Eigen::Index own = free.columns.cols();
  TrackInput track{.observations = one.observations};
  for (std::size_t k = 0; k < input.steps.size(); ++k) {
    const Motion& motion = input.steps[k].motion;
    Eigen::Matrix3Xd by_all(3, own + shares_of(robot));
    if (own > 0) by_all.leftCols(own) = input.by_parameters[k] * free.columns;
    if (shares_of(robot) > 0)
      by_all.rightCols(kShares) = motion.by_first(input.systematic.count()).rightCols(kShares);
    track.time_s.push_back(input.steps[k].time_s);
    track.motions.push_back({motion.mean, motion.covariance, std::move(by_all)});
  }
  return track;
}

/// What wheels and gyro say of each other: with a gyro the motion hardly depends on the track, and what no
/// motion explains shows it.
Information redundancy_of(std::span<const AssociatedRecording> all, const Robot& robot,
                          const FreeColumns& free) {
  const auto n = static_cast<Eigen::Index>(free.parameters.size());
  Information sum = Information::zero(n);
  const Robot noisy = with_noise_of_readings(robot, free.nominal);
  for (const AssociatedRecording& one : all)
    for (const Information& block :
         chassis_likelihood(one.run, noisy, free.parameters, {.gate = kParityGate}))
      sum.add(block);
  const Eigen::Index own = free.columns.cols();
  const Eigen::Index unknowns = own + shares_of(robot);
  Information evidence{Eigen::MatrixXd::Zero(unknowns, unknowns), Eigen::VectorXd::Zero(unknowns), sum.chi2,
                       sum.count};
  evidence.matrix.topLeftCorner(own, own) = free.columns.transpose() * sum.matrix * free.columns;
  evidence.gradient.head(own) = free.columns.transpose() * sum.gradient;
  return evidence;
}

}  // namespace

JointProblem joint_problem(std::span<const AssociatedRecording> all, const Robot& robot,
                           const FreeColumns& free) {
  Eigen::VectorXd information(free.information.size() + shares_of(robot));
  information.head(free.information.size()) = free.information;
  if (shares_of(robot) > 0) information.tail<kShares>() = kUsualShareSigma.cwiseAbs2().cwiseInverse();
  JointProblem joint{{.sensor = *robot.landmark_sensor,
                      .motions = {},
                      .sightings = {},
                      .parameter_information = std::move(information),
                      .parameter_evidence = redundancy_of(all, robot, free),
                      .gate = kDefaultGate},
                     {}};
  for (const AssociatedRecording& one : all)
    joint.tracks.emplace_back(track_input(one, robot, free), joint.problem);
  return joint;
}

Trajectory poses_at_keyframes(const JointProblem& joint, std::span<const AssociatedRecording> all) {
  Trajectory keyframes;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Trajectory own = joint.tracks[i].at_keyframes(all[i].path);
    keyframes.poses.insert(keyframes.poses.end(), own.poses.begin(), own.poses.end());
  }
  return keyframes;
}

}  // namespace trundle::slam
