#include "trundle/slam/smoothing/landmark_calibration.hpp"

#include <algorithm>
#include <map>

#include <Eigen/LU>
#include <fmt/format.h>

#include "trundle/calibration/chassis_likelihood.hpp"
#include "trundle/calibration/conclusion.hpp"
#include "trundle/calibration/defaults.hpp"
#include "trundle/calibration/noise.hpp"
#include "trundle/io/error.hpp"
#include "trundle/slam/smoothing/shown.hpp"
#include "trundle/slam/smoothing/smoother.hpp"
#include "trundle/slam/smoothing/smoother_start.hpp"
#include "trundle/slam/smoothing/track.hpp"

namespace trundle {
namespace {

constexpr int kMostRounds = 30;
constexpr double kSettled = 0.01;  // a round moves the parameters by less than this many sigmas
// How often landmarks without names are told apart, and how many sigmas no parameter moves by once that
// stays.
constexpr int kMostLooks = 10;
constexpr double kSameRobot = 0.1;
// Information below this share of the largest is rounding.
constexpr double kRounding = 1e-10;
// Sightings or odometry scatter by so much more, or less, than their sigmas that a person should know.
constexpr double kScattersMore = 1.5;
// A window of readings whose contradiction chance makes once in 10⁶ is slip.
constexpr double kContradictionGate = 30.0;

/// A recording as it was understood.
struct Seen {
  const Recording& recording;
  Run run;  ///< its readings
  bool has_nameless = false;
  ShownObservations observations;  ///< by step
  Trajectory path;

  double duration_s() const { return path.poses.back().time_s - path.poses.front().time_s; }
};

/// Landmarks without names are told apart by the filter, and once more by who knows the whole path.
Seen seen_in(const Recording& recording, const Robot& robot) {
  AlignedReadings readings = align(recording, robot);
  const SlamInput input = slam_input(recording, readings, robot, {.shares = true});
  Run run = prepare_run(recording, robot, std::move(readings));
  const bool has_nameless = input.has_nameless();
  const SlamResult filtered = slam(input, *robot.landmark_sensor,
                                   {.method = SlamMethod::ekf,
                                    .prior = {.systematic_sigma = input.systematic.sigma(kUsualShareSigma)},
                                    .first_nameless = input.first_nameless()});
  if (!has_nameless || filtered.map.empty())
    return {recording, std::move(run), has_nameless, shown_observations(input, filtered), filtered.online};
  SmoothedSlam smoothed = smooth(input, *robot.landmark_sensor, filtered);
  return {recording, std::move(run), has_nameless, std::move(smoothed.shown), std::move(smoothed.trajectory)};
}

/// Parameters are sought as `robot` + columns · q, q about 0 with `information`.
struct Sought {
  const Robot* nominal = nullptr;
  std::span<const Parameter> parameters;
  Eigen::MatrixXd columns;
  Eigen::VectorXd information;
};

/// All recordings as one problem; each is a track of its own.
struct Posed {
  SmoothingProblem problem;
  std::vector<Track> tracks;
};

TrackInput track_input(const Seen& seen, const Robot& robot, const Sought& sought) {
  const SlamInput input = slam_input(
      seen.recording, robot, {.parameters = std::vector(sought.parameters.begin(), sought.parameters.end())});
  TrackInput track{.observations = seen.observations};
  for (std::size_t k = 0; k < input.steps.size(); ++k) {
    const SlamStep& step = input.steps[k];
    track.time_s.push_back(step.time_s);
    track.motions.push_back(
        {step.motion.mean, step.motion.covariance, input.by_parameters[k] * sought.columns});
  }
  return track;
}

/// What wheels and gyro say of each other: with a gyro the motion hardly depends on the track, and what no
/// motion explains shows it.
Information redundancy_of(std::span<const Seen> all, const Robot& robot, const Sought& sought) {
  const auto n = static_cast<Eigen::Index>(sought.parameters.size());
  Information sum = Information::zero(n);
  const Robot noisy = with_noise_of_readings(robot, sought.nominal->chassis);
  for (const Seen& seen : all)
    for (const Information& piece :
         chassis_likelihood(seen.run, noisy, sought.parameters, {.gate = kContradictionGate}))
      sum.add(piece);
  const Eigen::MatrixXd& C = sought.columns;
  return {C.transpose() * sum.matrix * C, C.transpose() * sum.gradient, sum.chi2, sum.count};
}

Posed posed(std::span<const Seen> all, const Robot& robot, const Sought& sought) {
  Posed posed{{.sensor = *robot.landmark_sensor,
               .motions = {},
               .sightings = {},
               .parameter_information = sought.information,
               .parameter_evidence = redundancy_of(all, robot, sought),
               .gate = kDefaultGate},
              {}};
  for (const Seen& seen : all) posed.tracks.emplace_back(track_input(seen, robot, sought), posed.problem);
  return posed;
}

Trajectory stations_of(const Posed& posed, std::span<const Seen> all) {
  Trajectory stations;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Trajectory own = posed.tracks[i].at_stations(all[i].path);
    stations.poses.insert(stations.poses.end(), own.poses.begin(), own.poses.end());
  }
  return stations;
}

void move(Robot& robot, const Sought& sought, const Eigen::VectorXd& q) {
  const Eigen::VectorXd step = sought.columns * q;
  for (std::size_t j = 0; j < sought.parameters.size(); ++j)
    if (const double by = step[static_cast<Eigen::Index>(j)]; by != 0.0)
      set_value(sought.parameters[j], value_of(sought.parameters[j], robot) + by, robot);
}

/// What the data alone say of parameters whose prior is known about unit sigmas.
Eigen::MatrixXd information_without_prior(const Eigen::MatrixXd& covariance) {
  const Eigen::Index n = covariance.rows();
  Eigen::MatrixXd information = covariance.inverse();
  information = (0.5 * (information + information.transpose())).eval();
  const double rounding = kRounding * information.cwiseAbs().maxCoeff();
  information -= Eigen::MatrixXd::Identity(n, n);
  return (information.array().abs() < rounding).select(0.0, information);
}

/// From nominal, held near it by the prior: a state to start from, and what can be told at all.
struct Approach {
  SmoothingState state;  ///< parameters in prior sigmas
  EstimableSpace space;
};

void require_determined(bool determined) {
  if (!determined) throw CannotAnswer("the sightings leave poses or landmarks undetermined");
}

Approach approach(std::span<const Seen> all, const Robot& nominal, std::span<const Parameter> parameters) {
  const auto n = static_cast<Eigen::Index>(parameters.size());
  Eigen::VectorXd scale(n);
  for (Eigen::Index j = 0; j < n; ++j)
    scale[j] = prior_sigma(parameters[static_cast<std::size_t>(j)], nominal);
  const Posed start =
      posed(all, nominal, {&nominal, parameters, scale.asDiagonal(), Eigen::VectorXd::Ones(n)});
  if (start.problem.sightings.empty())
    throw CannotAnswer("no sighting shows a known landmark: nothing to calibrate with");
  Minimiser minimiser(start.problem);
  const Found found = minimum_from(start.problem, stations_of(start, all), minimiser, {});
  require_determined(minimiser.linearise(start.problem, found.minimum.state));
  const Eigen::MatrixXd information = information_without_prior(minimiser.parameter_covariance());
  const Eigen::VectorXd inverse_scale = scale.cwiseInverse();
  return {found.minimum.state,
          estimable_space(inverse_scale.asDiagonal() * information * inverse_scale.asDiagonal(), parameters,
                          nominal)};
}

RunEvidence evidence_of(const Posed& posed, std::size_t index, const SmoothingState& state) {
  const Track& track = posed.tracks[index];
  const auto is_own = [&](int pose) {
    return pose >= track.first_pose() && pose < track.first_pose() + static_cast<int>(track.stations());
  };
  SmoothingProblem own = posed.problem;
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
  return std::sqrt(q.dot(covariance.inverse() * q));
}

/// What was found, and how well noise as the robot file has it explains what is left.
struct Fitted {
  Estimate estimate;
  double scatter = 1.0;  ///< cost for each degree of freedom
};

/// Gauss-Newton without prior in what can be told: in every round the motions are those of the robot found so
/// far.
class Search {
 public:
  Search(std::span<const Seen> all, const Robot& nominal, std::span<const Parameter> parameters) : all_(all) {
    Approach start = approach(all, nominal, parameters);
    const auto n = static_cast<Eigen::Index>(parameters.size());
    fit_.estimate.robot = nominal;
    fit_.estimate.space = std::move(start.space);
    fit_.estimate.covariance = Eigen::MatrixXd::Zero(n, n);
    const EstimableSpace& space = fit_.estimate.space;
    sought_ = {&nominal, parameters, space.scale.asDiagonal() * space.basis,
               Eigen::VectorXd::Zero(space.basis.cols())};
    state_ = std::move(start.state);
    move(fit_.estimate.robot, sought_, space.basis.transpose() * state_.parameters);
  }

  Fitted fit() {
    if (sought_.columns.cols() == 0) return fit_;
    const Posed first = posed(all_, fit_.estimate.robot, sought_);
    Minimiser minimiser(first.problem);
    for (int round = 0; round < kMostRounds && !fit_.estimate.descent.converged; ++round) step(minimiser);
    return fit_;
  }

 private:
  void step(Minimiser& minimiser) {
    Estimate& estimate = fit_.estimate;
    const Posed here = posed(all_, estimate.robot, sought_);
    state_.parameters = Eigen::VectorXd::Zero(sought_.columns.cols());
    Minimum minimum = minimiser.minimise(here.problem, std::move(state_));
    state_ = std::move(minimum.state);
    require_determined(minimiser.linearise(here.problem, state_));
    const Eigen::MatrixXd covariance = minimiser.parameter_covariance();
    move(estimate.robot, sought_, state_.parameters);
    Descent& descent = estimate.descent;
    ++descent.iterations;
    descent.last_step = sigmas_of(state_.parameters, covariance);
    (sought_.columns * state_.parameters).cwiseAbs().maxCoeff(&descent.parameter);
    descent.converged = minimum.converged && descent.last_step < kSettled;
    estimate.degrees_of_freedom =
        std::max(1, degrees_of_freedom(here.problem) - static_cast<int>(sought_.columns.cols()));
    fit_.scatter = minimum.cost / estimate.degrees_of_freedom;
    estimate.dispersion = std::max(1.0, fit_.scatter);
    estimate.covariance = estimate.dispersion * sought_.columns * covariance * sought_.columns.transpose();
    allow_for_bias_walk(estimate);
    estimate.runs.clear();
    for (std::size_t i = 0; i < all_.size(); ++i) estimate.runs.push_back(evidence_of(here, i, state_));
  }

  /// What was found of the gyro's bias is its mean over the runs, and it walks: over a time T by a mean
  /// square of walk² T/3.
  void allow_for_bias_walk(Estimate& estimate) const {
    const auto at = std::ranges::find(sought_.parameters, kGyroBias);
    const auto j = static_cast<Eigen::Index>(at - sought_.parameters.begin());
    if (at == sought_.parameters.end() || estimate.covariance(j, j) == 0.0) return;
    double duration_s = 0.0;
    for (const Seen& seen : all_) duration_s = std::max(duration_s, seen.duration_s());
    const double walk = estimate.robot.chassis.gyro->bias_walk_rad_s_sqrt_s;
    estimate.covariance(j, j) += walk * walk * duration_s / 3.0;
  }

  std::span<const Seen> all_;
  Sought sought_;
  SmoothingState state_;  ///< parameters about those of the robot found so far
  Fitted fit_;
};

Fitted fit_to(std::span<const Seen> all, const Robot& nominal, std::span<const Parameter> parameters) {
  return Search(all, nominal, parameters).fit();
}

std::vector<Seen> see(std::span<const Recording> recordings, const Robot& robot) {
  std::vector<Seen> all;
  for (const Recording& recording : recordings) all.push_back(seen_in(recording, robot));
  return all;
}

/// What was seen, and the robot that was found from it.
struct Understood {
  std::vector<Seen> all;
  Fitted fit;
  double unsettled = 0.0;  ///< by so many sigmas a parameter moved when landmarks were last told apart
};

/// The most that a parameter differs by, in its sigmas.
double largest_shift(const Estimate& before, const Estimate& after, std::span<const Parameter> parameters) {
  double largest = 0.0;
  for (std::size_t j = 0; j < parameters.size(); ++j) {
    const auto row = static_cast<Eigen::Index>(j);
    const double shift = value_of(parameters[j], after.robot) - value_of(parameters[j], before.robot);
    if (const double variance = after.covariance(row, row); variance > 0.0)
      largest = std::max(largest, std::abs(shift) / std::sqrt(variance));
  }
  return largest;
}

/// A wrong robot takes landmarks for one another, and what was taken wrongly makes the robot wrong: both are
/// found in turn, until the robot stays.
Understood understood(std::span<const Recording> recordings, const Robot& nominal,
                      std::span<const Parameter> parameters) {
  Understood result{see(recordings, nominal), {}};
  result.fit = fit_to(result.all, nominal, parameters);
  if (std::ranges::none_of(result.all, &Seen::has_nameless)) return result;
  for (int looks = 1; looks < kMostLooks; ++looks) {
    const Estimate before = result.fit.estimate;
    result.all = see(recordings, before.robot);
    result.fit = fit_to(result.all, nominal, parameters);
    result.unsettled = largest_shift(before, result.fit.estimate, parameters);
    if (result.unsettled < kSameRobot) break;
  }
  return result;
}

SessionSpread session_spread(std::span<const Seen> all, const Robot& nominal,
                             std::span<const Parameter> parameters, const EstimableSpace& space) {
  std::map<std::string, std::vector<Seen>> sessions;
  for (const Seen& seen : all) sessions.try_emplace(seen.recording.session).first->second.push_back(seen);
  std::vector<Estimate> estimates;
  if (sessions.size() > 1)
    for (const auto& [name, own] : sessions) estimates.push_back(fit_to(own, nominal, parameters).estimate);
  return spread_of(estimates, parameters, space);
}

std::vector<Run> prepared(std::span<const Recording> recordings, const Robot& robot) {
  std::vector<Run> runs;
  for (const Recording& recording : recordings) runs.push_back(prepare_run(recording, robot));
  return runs;
}

void add_words(const Understood& what, CalibrationResult& result) {
  const double scatter = what.fit.scatter;
  std::size_t sightings = 0;
  for (const Seen& seen : what.all) sightings += seen.recording.sightings.size();
  result.notes.push_back(
      fmt::format("from {} sightings, without any reference: lengths are those of the landmark sensor, a "
                  "common error of its ranges is one of all diameters",
                  sightings));
  if (what.unsettled >= kSameRobot)
    result.warnings.push_back(
        fmt::format("which sighting shows which landmark did not settle: told apart {} times, a parameter "
                    "still moved by {:.1f} of its sigmas; the error bars do not allow for it",
                    kMostLooks, what.unsettled));
  if (scatter > kScattersMore)
    result.warnings.push_back(
        fmt::format("sightings and odometry scatter {:.1f} times as much as the robot file says; the error "
                    "bars allow for it",
                    std::sqrt(scatter)));
  if (scatter < 1.0 / kScattersMore)
    result.notes.push_back(
        fmt::format("sightings and odometry scatter {:.2f} times as much as the robot file says; the error "
                    "bars are those of the robot file",
                    std::sqrt(scatter)));
}

}  // namespace

CalibrationResult calibrate_from_landmarks(std::span<const Recording> training,
                                           std::span<const Recording> hold_out, const Robot& nominal,
                                           const CalibrateOptions& options) {
  const std::vector<Parameter> parameters =
      choose_parameters(nominal, {.length = true, .anything = true}, options.free, options.fix);
  require_something_free(parameters, training, nominal);
  const Understood what = understood(training, nominal, parameters);
  const Estimate& estimate = what.fit.estimate;
  require_something_estimated(estimate, parameters, nominal);
  const SessionSpread spread = session_spread(what.all, nominal, parameters, estimate.space);
  CalibrationResult result = result_of(estimate, spread, parameters, nominal);
  result.method = "landmarks";
  add_words(what, result);
  conclude({prepared(training, nominal), prepared(hold_out, nominal)}, estimate, spread, result);
  return result;
}

}  // namespace trundle
