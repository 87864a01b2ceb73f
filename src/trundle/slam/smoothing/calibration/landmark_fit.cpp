#include "trundle/slam/smoothing/calibration/landmark_fit.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "trundle/calibration/likelihood/information.hpp"
#include "trundle/calibration/solve/own_axes.hpp"
#include "trundle/geometry/decompositions.hpp"
#include "trundle/geometry/squared.hpp"
#include "trundle/io/error.hpp"
#include "trundle/odometry/odometer.hpp"
#include "trundle/slam/smoothing/calibration/noise_information.hpp"
#include "trundle/slam/smoothing/calibration/reference_positions.hpp"
#include "trundle/slam/smoothing/smoother_start.hpp"

namespace trundle::slam {
namespace {

// Rounds, after each of which all motions are computed anew.
constexpr int kMostRounds = 30;
constexpr double kSettled = 0.01;  // a round moves the parameters by less than this many sigmas
// And the spread of biases, and what positions err by, by less than this share: what it weighs changes by a
// tenth.
constexpr double kSameSpread = 0.05;
// Information below this share of the largest is rounding.
constexpr double kRounding = 1e-10;
/// What the data alone say of parameters whose prior is known about unit sigmas.
Eigen::MatrixXd information_without_prior(const Eigen::MatrixXd& covariance) {
  const Eigen::Index n = covariance.rows();
  if (n == 0) return covariance;
  Eigen::MatrixXd information = inverse_of(covariance);
  information = (0.5 * (information + information.transpose())).eval();
  const double rounding = kRounding * information.cwiseAbs().maxCoeff();
  information -= Eigen::MatrixXd::Identity(n, n);
  return (information.array().abs() < rounding).select(0.0, information);
}

/// The parameters of the robot among those of a problem come first.
Eigen::MatrixXd covariance_of_own(const Minimiser& linearised, Eigen::Index own) {
  return linearised.parameter_covariance().topLeftCorner(own, own);
}

/// From nominal, held near it by the prior: a state to start from, and what can be determined at all.
struct RoughFit {
  SmoothingState state;  ///< parameters in prior sigmas, own biases and walks
  EstimableSpace space;
  Eigen::MatrixXd held_covariance;  ///< of all parameters, in their own units
  OwnBiases own;
  std::vector<BiasWalk> walks;
  double position_sigma_m = 0.0;
};

void require_determined(bool determined) {
  if (!determined) throw CannotAnswer("the sightings leave poses or landmarks undetermined");
}

/// A clock that leads sightings out of the odometry's time makes another problem of it, and so does an error
/// of ranges that leaves nothing of a distance.
void require_same_sightings(const SmoothingProblem& problem, const SmoothingState& state) {
  if (problem.poses == static_cast<int>(state.poses.size()) &&
      problem.landmarks == static_cast<int>(state.landmarks.size()))
    return;
  throw CannotAnswer(
      "what the landmark sensor errs by comes out so large that sightings are beyond the odometry, or no "
      "distance is left of their ranges: they do not determine it; leave sensor.time_offset, "
      "sensor.range_offset "
      "or "
      "sensor.depth_share as it is");
}

bool seeks_gyro_bias(const Robot& nominal, std::span<const Parameter> parameters) {
  return nominal.chassis.gyro && contains(parameters, ParameterKind::gyro_bias);
}

/// Where more than one recording shows the gyro's bias, and it is sought.
OwnBiases own_biases(std::span<const AssociatedRecording> all, const Robot& nominal,
                     std::span<const Parameter> parameters) {
  OwnBiases own{.unit_rad_s = initial_bias_sigma(nominal)};
  if (!seeks_gyro_bias(nominal, parameters)) return own;
  for (const AssociatedRecording& one : all)
    own.rad_s.push_back(one.run.shows_gyro_bias() ? std::optional(0.0) : std::nullopt);
  if (own.count() < 2) own.rad_s.clear();
  return own;
}

/// Where the gyro's bias is sought.
std::vector<BiasWalk> bias_walks(std::span<const AssociatedRecording> all, const Robot& nominal,
                                 std::span<const Parameter> parameters) {
  if (!seeks_gyro_bias(nominal, parameters)) return {};
  std::vector<BiasWalk> walks;
  for (const AssociatedRecording& one : all)
    walks.push_back(bias_walk_of(*nominal.chassis.gyro, one.start_s(), one.end_s()));
  return walks;
}

/// What changes with the robot's own axes, which are anybody's choice: only where the sensor stands would
/// show what is ahead, and that is known by tape.
Eigen::MatrixXd own_axes_moved(std::span<const Parameter> parameters, const Robot& nominal) {
  std::vector<Eigen::VectorXd> moved = origin_moved(parameters, nominal);
  if (contains(parameters, ParameterKind::sensor_bearing_offset))
    if (auto turned = axes_turned(parameters, nominal)) moved.push_back(std::move(*turned));
  Eigen::MatrixXd columns(static_cast<Eigen::Index>(parameters.size()),
                          static_cast<Eigen::Index>(moved.size()));
  for (std::size_t i = 0; i < moved.size(); ++i) columns.col(static_cast<Eigen::Index>(i)) = moved[i];
  return columns;
}

RoughFit rough_fit(std::span<const AssociatedRecording> all, const Robot& nominal,
                   std::span<const Parameter> parameters) {
  const Eigen::VectorXd scale = prior_sigmas(parameters, nominal);
  OwnBiases own = own_biases(all, nominal, parameters);
  std::vector<BiasWalk> walks = bias_walks(all, nominal, parameters);
  const FreeColumns free{.nominal = nominal.chassis,
                         .parameters = {parameters.begin(), parameters.end()},
                         .columns = scale.asDiagonal(),
                         .information = Eigen::VectorXd::Ones(scale.size()),
                         .own = own,
                         .walks = walks,
                         .position_sigma_m = rough_position_sigma(all, nominal)};
  JointProblem start = joint_problem(all, nominal, free, true);
  if (start.problem.sightings.empty())
    throw CannotAnswer("no sighting shows a known landmark: nothing to calibrate with");
  Minimiser minimiser(start.problem);
  const Found found = minimum_from(start.problem, poses_at_keyframes(start, all), minimiser, {});
  correct_readings(found.minimum.state, start.problem);
  require_determined(minimiser.linearise(start.problem, found.minimum.state));
  const Eigen::MatrixXd shown = information_without_prior(covariance_of_own(minimiser, scale.size()));
  const Eigen::MatrixXd of_noise =
      noise_information(start.problem, found.minimum.state, minimiser, scale.size());
  // With the prior: what is hardly seen at all stays hardly seen, and not unseen.
  const Eigen::MatrixXd prior = Eigen::MatrixXd::Identity(scale.size(), scale.size());
  const Eigen::MatrixXd K = calibration::share_known(shown + prior, of_noise);
  const Eigen::MatrixXd known = scale.cwiseInverse().asDiagonal() * K;
  Eigen::MatrixXd observed = known * shown * known.transpose();
  observed = with_held(own_axes_moved(parameters, nominal), scale, observed);
  own.move(found.minimum.state.parameters.segment(scale.size(), own.count()));
  EstimableSpace space = estimable_space(observed, parameters, nominal);
  Eigen::MatrixXd held = held_covariance(observed, space, parameters, nominal);
  return {found.minimum.state, std::move(space),
          std::move(held),     std::move(own),
          std::move(walks),    position_sigma(start.problem, found.minimum.state, minimiser)};
}

RunEvidence evidence_of(const JointProblem& joint, std::size_t index, const SmoothingState& state) {
  const Track& track = joint.tracks[index];
  const auto is_own = [&](int pose) {
    return pose >= track.first_pose() && pose < track.first_pose() + static_cast<int>(track.keyframes());
  };
  SmoothingProblem own = joint.problem;
  own.parameter_evidence = Information::zero(0);
  own.parameter_information.setZero();
  own.landmarks = static_cast<int>(track.landmarks().size());
  std::erase_if(own.motions, [&](const MotionLink& link) { return !is_own(link.to); });
  std::erase_if(own.sightings, [&](const SightingLink& link) { return !is_own(link.pose); });
  std::erase_if(own.positions, [&](const PositionLink& link) { return !is_own(link.pose); });
  own.free_starts = own.positions.empty() ? 0 : 1;
  RunEvidence evidence;
  evidence.chi2_per_dof = cost_of(own, state) / std::max(1, degrees_of_freedom(own));
  return evidence;
}

/// How far a step goes, in sigmas of what is sought.
double sigmas_of(const Eigen::VectorXd& q, const Eigen::MatrixXd& covariance) {
  return q.size() == 0 ? 0.0 : std::sqrt(q.dot(inverse_of(covariance) * q));
}

/// A fit on its way.
struct LandmarkSearch {
  std::span<const AssociatedRecording> all;
  LandmarkFit fit;
  Eigen::VectorXd last = {};  ///< what the round before found
  double share = 1.0;         ///< of it that is taken: less where rounds turn back
};

/// Starts where the prior holds the robot near nominal.
LandmarkSearch search_from(std::span<const AssociatedRecording> all, const Robot& nominal,
                           std::span<const Parameter> parameters) {
  RoughFit rough = rough_fit(all, nominal, parameters);
  const auto n = static_cast<Eigen::Index>(parameters.size());
  LandmarkSearch search{.all = all, .fit = {}};
  search.fit.state = std::move(rough.state);
  Estimate& estimate = search.fit.estimate;
  estimate.robot = nominal;
  estimate.space = std::move(rough.space);
  estimate.held_covariance = std::move(rough.held_covariance);
  estimate.covariance = Eigen::MatrixXd::Zero(n, n);
  const EstimableSpace& space = estimate.space;
  const Eigen::Index determined = space.basis.cols();
  search.fit.free = {.nominal = nominal.chassis,
                     .parameters = {parameters.begin(), parameters.end()},
                     .columns = space.scale.asDiagonal() * space.basis,
                     .information = Eigen::VectorXd::Zero(determined),
                     .own = std::move(rough.own),
                     .walks = std::move(rough.walks),
                     .position_sigma_m = rough.position_sigma_m};
  move(parameters, search.fit.free.columns * (space.basis.transpose() * search.fit.state.parameters.head(n)),
       estimate.robot);
  return search;
}

/// What was found of the gyro's bias is its mean over a run, of which at either end it is walk² T/3 off in
/// the mean square. Where each run has its own, that is part of how they spread.
void allow_for_bias_walk(const LandmarkSearch& search, Estimate& estimate) {
  if (search.fit.free.own.count() > 0) return;
  const Eigen::Index j = search.fit.free.row_of_gyro_bias();
  if (j == estimate.covariance.rows() || estimate.covariance(j, j) == 0.0) return;
  double duration_s = 0.0;
  for (const AssociatedRecording& one : search.all) duration_s = std::max(duration_s, one.duration_s());
  const double walk = estimate.robot.chassis.gyro->bias_walk_rad_s_sqrt_s;
  estimate.covariance(j, j) += walk * walk * duration_s / 3.0;
}

/// The gyro's bias of each recording: the shared one and its own, which are uncertain together.
std::vector<std::optional<GyroBias>> gyro_biases_of(const LandmarkSearch& search,
                                                    const Eigen::MatrixXd& covariance) {
  const FreeColumns& free = search.fit.free;
  const Eigen::Index n = free.columns.cols();
  const Estimate& estimate = search.fit.estimate;
  std::vector<std::optional<GyroBias>> biases(free.own.rad_s.size());
  for (std::size_t i = 0; i < biases.size(); ++i) {
    const auto place = free.own.place_of(i);
    if (!place) continue;
    Eigen::VectorXd by_sought = Eigen::VectorXd::Zero(covariance.rows());
    by_sought.head(n) = free.columns.row(free.row_of_gyro_bias());
    by_sought[n + *place] = free.own.unit_rad_s;
    biases[i] = {value_of(kGyroBias, estimate.robot) + free.own.of(i),
                 estimate.dispersion * by_sought.dot(covariance * by_sought)};
  }
  return biases;
}

/// The evidence of a minimum: how sightings and odometry scatter, the covariance, each recording's share.
void set_evidence(const JointProblem& joint, double cost, const Eigen::MatrixXd& of_all,
                  LandmarkSearch& search) {
  Estimate& estimate = search.fit.estimate;
  const Eigen::MatrixXd& C = search.fit.free.columns;
  const Eigen::MatrixXd covariance = of_all.topLeftCorner(C.cols(), C.cols());
  estimate.degrees_of_freedom = std::max(1, degrees_of_freedom(joint.problem) - static_cast<int>(C.cols()));
  search.fit.scatter = cost / estimate.degrees_of_freedom;
  estimate.dispersion = std::max(1.0, search.fit.scatter);
  estimate.covariance = estimate.dispersion * C * covariance * C.transpose();
  allow_for_bias_walk(search, estimate);
  estimate.gyro_biases = gyro_biases_of(search, of_all);
  estimate.runs.clear();
  for (std::size_t i = 0; i < search.all.size(); ++i)
    estimate.runs.push_back(evidence_of(joint, i, search.fit.state));
}

/// Finds how biases spread from recording to recording, and what their priors weigh. Returns whether the
/// spread stays.
bool settle_spread(const Eigen::MatrixXd& covariance, LandmarkSearch& search) {
  OwnBiases& own = search.fit.free.own;
  Estimate& estimate = search.fit.estimate;
  search.fit.free.walk_information = estimate.dispersion;
  if (own.count() == 0) return true;
  const double before = estimate.gyro_bias_spread.prior_rad_s;
  const Eigen::Index sought = search.fit.free.columns.cols() + own.count();
  estimate.gyro_bias_spread = spread_of(own, covariance.topLeftCorner(sought, sought), estimate.dispersion);
  const double found = estimate.gyro_bias_spread.prior_rad_s;
  own.information = estimate.dispersion * squared(own.unit_rad_s / found);
  return std::abs(found - before) <= kSameSpread * found;
}

/// Finds what positions by the reference err by. Returns whether that stays.
bool settle_positions(const SmoothingProblem& problem, const Minimiser& minimiser, LandmarkSearch& search) {
  if (problem.positions.empty()) return true;
  const double found = position_sigma(problem, search.fit.state, minimiser);
  const double before = std::exchange(search.fit.free.position_sigma_m, found);
  return std::abs(found - before) <= kSameSpread * found;
}

/// One round: the minimum with the motions of the robot found so far, which then moves there.
void improve(LandmarkSearch& search) {
  Estimate& estimate = search.fit.estimate;
  SmoothingState& state = search.fit.state;
  FreeColumns& free = search.fit.free;
  const Eigen::Index own = free.columns.cols();
  JointProblem here = joint_problem(search.all, estimate.robot, free);
  require_same_sightings(here.problem, state);
  state.parameters = free.parameters_from_here(state.parameters);
  correct_readings(state, here.problem);
  Minimiser minimiser(here.problem);  // a clock that moved may show landmarks from other poses
  Minimum minimum = minimiser.minimise(here.problem, std::move(state));
  state = std::move(minimum.state);
  require_determined(minimiser.linearise(here.problem, state));
  const Eigen::MatrixXd of_all = minimiser.parameter_covariance();
  const Eigen::MatrixXd covariance = of_all.topLeftCorner(own, own);
  const Eigen::VectorXd found = state.parameters.head(own);
  // Cut at other times within rows of coarse counts, motions change more than their derivative says.
  if (search.last.size() == found.size() && found.dot(search.last) < 0.0) search.share *= 0.5;
  search.last = found;
  const Eigen::VectorXd step = search.share * (free.columns * found);
  move(free.parameters, step, estimate.robot);
  free.own.move(state.parameters.segment(own, free.own.count()));
  Descent& descent = estimate.descent;
  ++descent.iterations;
  descent.last_step = sigmas_of(found, covariance);
  if (step.size() > 0) step.cwiseAbs().maxCoeff(&descent.parameter);
  set_evidence(here, minimum.cost, of_all, search);
  const bool positions_stay = settle_positions(here.problem, minimiser, search);
  const bool stays = settle_spread(of_all, search) && positions_stay;
  descent.converged = minimum.converged && descent.last_step < kSettled && stays;
  if (descent.converged) search.fit.sensor = sensor_scores(here.problem, state, minimiser);
}

}  // namespace

LandmarkFit fit_landmarks(std::span<const AssociatedRecording> all, const Robot& nominal,
                          std::span<const Parameter> parameters) {
  LandmarkSearch search = search_from(all, nominal, parameters);
  search.fit.estimate.measures_length = true;  // by the ranges
  if (search.fit.free.columns.cols() == 0 && !parameters.empty()) return search.fit;
  for (int round = 0; round < kMostRounds && !search.fit.estimate.descent.converged; ++round) improve(search);
  return search.fit;
}

}  // namespace trundle::slam
