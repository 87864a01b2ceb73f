#include "trundle/slam/smoothing/landmark_fit.hpp"

#include <algorithm>

#include "trundle/calibration/chassis_likelihood.hpp"
#include "trundle/geometry/decompositions.hpp"
#include "trundle/io/error.hpp"
#include "trundle/slam/smoothing/smoother.hpp"
#include "trundle/slam/smoothing/smoother_start.hpp"
#include "trundle/slam/smoothing/track.hpp"

namespace trundle::slam {
namespace {

// Rounds, after each of which all motions are computed anew.
constexpr int kMostRounds = 30;
constexpr double kSettled = 0.01;  // a round moves the parameters by less than this many sigmas
// Information below this share of the largest is rounding.
constexpr double kRounding = 1e-10;
// A window of readings whose parity residual chance makes once in 10⁶ is slip.
constexpr double kParityGate = 30.0;

/// Parameters are sought as `robot` + columns · q, q about 0 with `information`.
struct FreeColumns {
  const Robot* nominal = nullptr;
  std::span<const Parameter> parameters;
  Eigen::MatrixXd columns;
  Eigen::VectorXd information;
};

/// All recordings as one problem; each is a track of its own.
struct JointProblem {
  SmoothingProblem problem;
  std::vector<Track> tracks;
};

TrackInput track_input(const AssociatedRecording& one, const Robot& robot, const FreeColumns& free) {
  const SlamInput input = slam_input(
      one.recording, robot, {.parameters = std::vector(free.parameters.begin(), free.parameters.end())});
  TrackInput track{.observations = one.observations};
  for (std::size_t k = 0; k < input.steps.size(); ++k) {
    const SlamStep& step = input.steps[k];
    track.time_s.push_back(step.time_s);
    track.motions.push_back(
        {step.motion.mean, step.motion.covariance, input.by_parameters[k] * free.columns});
  }
  return track;
}

/// What wheels and gyro say of each other: with a gyro the motion hardly depends on the track, and what no
/// motion explains shows it.
Information redundancy_of(std::span<const AssociatedRecording> all, const Robot& robot,
                          const FreeColumns& free) {
  const auto n = static_cast<Eigen::Index>(free.parameters.size());
  Information sum = Information::zero(n);
  const Robot noisy = with_noise_of_readings(robot, free.nominal->chassis);
  for (const AssociatedRecording& one : all)
    for (const Information& block :
         chassis_likelihood(one.run, noisy, free.parameters, {.gate = kParityGate}))
      sum.add(block);
  const Eigen::MatrixXd& C = free.columns;
  return {C.transpose() * sum.matrix * C, C.transpose() * sum.gradient, sum.chi2, sum.count};
}

JointProblem joint_problem(std::span<const AssociatedRecording> all, const Robot& robot,
                           const FreeColumns& free) {
  JointProblem joint{{.sensor = *robot.landmark_sensor,
                      .motions = {},
                      .sightings = {},
                      .parameter_information = free.information,
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

/// What the data alone say of parameters whose prior is known about unit sigmas.
Eigen::MatrixXd information_without_prior(const Eigen::MatrixXd& covariance) {
  const Eigen::Index n = covariance.rows();
  Eigen::MatrixXd information = inverse_of(covariance);
  information = (0.5 * (information + information.transpose())).eval();
  const double rounding = kRounding * information.cwiseAbs().maxCoeff();
  information -= Eigen::MatrixXd::Identity(n, n);
  return (information.array().abs() < rounding).select(0.0, information);
}

/// From nominal, held near it by the prior: a state to start from, and what can be told at all.
struct RoughFit {
  SmoothingState state;  ///< parameters in prior sigmas
  EstimableSpace space;
};

void require_determined(bool determined) {
  if (!determined) throw CannotAnswer("the sightings leave poses or landmarks undetermined");
}

RoughFit rough_fit(std::span<const AssociatedRecording> all, const Robot& nominal,
                   std::span<const Parameter> parameters) {
  const Eigen::VectorXd scale = prior_sigmas(parameters, nominal);
  const JointProblem start = joint_problem(
      all, nominal, {&nominal, parameters, scale.asDiagonal(), Eigen::VectorXd::Ones(scale.size())});
  if (start.problem.sightings.empty())
    throw CannotAnswer("no sighting shows a known landmark: nothing to calibrate with");
  Minimiser minimiser(start.problem);
  const Found found = minimum_from(start.problem, poses_at_keyframes(start, all), minimiser, {});
  require_determined(minimiser.linearise(start.problem, found.minimum.state));
  const Eigen::MatrixXd information = information_without_prior(minimiser.parameter_covariance());
  const Eigen::VectorXd inverse_scale = scale.cwiseInverse();
  return {found.minimum.state,
          estimable_space(inverse_scale.asDiagonal() * information * inverse_scale.asDiagonal(), parameters,
                          nominal)};
}

RunEvidence evidence_of(const JointProblem& joint, std::size_t index, const SmoothingState& state) {
  const Track& track = joint.tracks[index];
  const auto is_own = [&](int pose) {
    return pose >= track.first_pose() && pose < track.first_pose() + static_cast<int>(track.keyframes());
  };
  SmoothingProblem own = joint.problem;
  own.parameter_evidence = Information::zero(0);
  own.landmarks = static_cast<int>(track.landmarks().size());
  std::erase_if(own.motions, [&](const MotionLink& link) { return !is_own(link.to); });
  std::erase_if(own.sightings, [&](const SightingLink& link) { return !is_own(link.pose); });
  RunEvidence evidence;
  evidence.chi2_per_dof = cost_of(own, state) / std::max(1, degrees_of_freedom(own));
  return evidence;
}

/// How far a step goes, in sigmas of what is sought.
double sigmas_of(const Eigen::VectorXd& q, const Eigen::MatrixXd& covariance) {
  return std::sqrt(q.dot(inverse_of(covariance) * q));
}

/// A fit on its way.
struct LandmarkSearch {
  std::span<const AssociatedRecording> all;
  FreeColumns free;
  SmoothingState state;  ///< parameters about those of the robot found so far
  LandmarkFit fit;
};

/// Starts where the prior holds the robot near nominal.
LandmarkSearch search_from(std::span<const AssociatedRecording> all, const Robot& nominal,
                           std::span<const Parameter> parameters) {
  RoughFit rough = rough_fit(all, nominal, parameters);
  const auto n = static_cast<Eigen::Index>(parameters.size());
  LandmarkSearch search{.all = all, .free = {}, .state = std::move(rough.state), .fit = {}};
  Estimate& estimate = search.fit.estimate;
  estimate.robot = nominal;
  estimate.space = std::move(rough.space);
  estimate.covariance = Eigen::MatrixXd::Zero(n, n);
  const EstimableSpace& space = estimate.space;
  search.free = {&nominal, parameters, space.scale.asDiagonal() * space.basis,
                 Eigen::VectorXd::Zero(space.basis.cols())};
  move(parameters, search.free.columns * (space.basis.transpose() * search.state.parameters), estimate.robot);
  return search;
}

/// What was found of the gyro's bias is its mean over the runs, and it walks: over a time T by a mean
/// square of walk² T/3.
void allow_for_bias_walk(const LandmarkSearch& search, Estimate& estimate) {
  const std::span<const Parameter> parameters = search.free.parameters;
  const auto at = std::ranges::find(parameters, kGyroBias);
  const auto j = static_cast<Eigen::Index>(at - parameters.begin());
  if (at == parameters.end() || estimate.covariance(j, j) == 0.0) return;
  double duration_s = 0.0;
  for (const AssociatedRecording& one : search.all) duration_s = std::max(duration_s, one.duration_s());
  const double walk = estimate.robot.chassis.gyro->bias_walk_rad_s_sqrt_s;
  estimate.covariance(j, j) += walk * walk * duration_s / 3.0;
}

/// The evidence of a minimum: how sightings and odometry scatter, the covariance, each recording's share.
void set_evidence(const JointProblem& joint, double cost, const Eigen::MatrixXd& covariance,
                  LandmarkSearch& search) {
  Estimate& estimate = search.fit.estimate;
  const Eigen::MatrixXd& C = search.free.columns;
  estimate.degrees_of_freedom = std::max(1, degrees_of_freedom(joint.problem) - static_cast<int>(C.cols()));
  search.fit.scatter = cost / estimate.degrees_of_freedom;
  estimate.dispersion = std::max(1.0, search.fit.scatter);
  estimate.covariance = estimate.dispersion * C * covariance * C.transpose();
  allow_for_bias_walk(search, estimate);
  estimate.runs.clear();
  for (std::size_t i = 0; i < search.all.size(); ++i)
    estimate.runs.push_back(evidence_of(joint, i, search.state));
}

/// One round: the minimum with the motions of the robot found so far, which then moves there.
void improve(Minimiser& minimiser, LandmarkSearch& search) {
  Estimate& estimate = search.fit.estimate;
  const JointProblem here = joint_problem(search.all, estimate.robot, search.free);
  search.state.parameters = Eigen::VectorXd::Zero(search.free.columns.cols());
  Minimum minimum = minimiser.minimise(here.problem, std::move(search.state));
  search.state = std::move(minimum.state);
  require_determined(minimiser.linearise(here.problem, search.state));
  const Eigen::MatrixXd covariance = minimiser.parameter_covariance();
  const Eigen::VectorXd step = search.free.columns * search.state.parameters;
  move(search.free.parameters, step, estimate.robot);
  Descent& descent = estimate.descent;
  ++descent.iterations;
  descent.last_step = sigmas_of(search.state.parameters, covariance);
  step.cwiseAbs().maxCoeff(&descent.parameter);
  descent.converged = minimum.converged && descent.last_step < kSettled;
  set_evidence(here, minimum.cost, covariance, search);
}

}  // namespace

LandmarkFit fit_landmarks(std::span<const AssociatedRecording> all, const Robot& nominal,
                          std::span<const Parameter> parameters) {
  LandmarkSearch search = search_from(all, nominal, parameters);
  search.fit.estimate.measures_length = true;  // by the ranges
  if (search.free.columns.cols() == 0) return search.fit;
  Minimiser minimiser(joint_problem(all, search.fit.estimate.robot, search.free).problem);
  for (int round = 0; round < kMostRounds && !search.fit.estimate.descent.converged; ++round)
    improve(minimiser, search);
  return search.fit;
}

}  // namespace trundle::slam
