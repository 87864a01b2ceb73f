#include "trundle/calibration/preparation/sensor_heading.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/LU>
#include <fmt/format.h>

#include "trundle/calibration/likelihood/likelihood.hpp"
#include "trundle/calibration/likelihood/relative_likelihood.hpp"
#include "trundle/calibration/solve/weights.hpp"
#include "trundle/geometry/decompositions.hpp"

namespace trundle::calibration {
namespace {

// Of a motion, to count as straight: a lever of half its way changes its direction by as much, and left turns
// take back what right turns do.
constexpr double kStraight_rad = 0.1;
// |Σ| over Σ| |: 1 where all directions agree, near 0 where they have nothing to do with each other.
constexpr double kAgree = 0.8;
constexpr double kFewestDirections = 10.0;  // so many unrelated directions agree by 0.8 in 1 of 2000 cases

// χ² of three degrees of freedom: 3 in 100 by chance, where what is misplaced has not passed for noise.
constexpr double kElsewhere = 9.0;
// What less is does no harm that anybody sees.
constexpr double kSeen_m = 0.01, kSeen_rad = 0.01;
// Information of parameters that nothing shows, in their priors': their equations stay solvable.
constexpr double kNothing = 1e-6;

constexpr std::array kSensorPose = {ParameterKind::reference_x, ParameterKind::reference_y,
                                    ParameterKind::reference_heading};

/// What references show of their sensor's pose: without headings nothing of where it looks.
std::span<const ParameterKind> shown_of_sensor(const CalibrationProblem& problem) {
  const std::span<const ParameterKind> pose = kSensorPose;
  const auto has_headings = [](const Run& run) { return run.reference.has_headings(); };
  return std::ranges::any_of(problem.runs, has_headings) ? pose : pose.first(2);
}

/// Whether another pose of the sensor and wheels that are moved with it explain the same.
bool all_places_are_free(const CalibrationProblem& problem) {
  const auto wheels = static_cast<std::ptrdiff_t>(problem.nominal.chassis.wheels().size());
  const auto free = [&](ParameterKind kind) {
    return std::ranges::count(problem.parameters, kind, &Parameter::kind);
  };
  return wheels > 0 && free(ParameterKind::direction) == wheels && free(ParameterKind::lever) == wheels;
}

/// Weighed as the estimate was.
Likelihood likelihood_at(const Estimate& estimate, const CalibrationProblem& problem) {
  Likelihood likelihood = likelihood_of(problem);
  set_noise(estimate.robot, estimate.noise, likelihood);
  likelihood.gyro_bias_spread_rad_s = estimate.gyro_bias_spread.prior_rad_s;
  set_own_parameters(estimate.robot, likelihood);
  for (std::size_t i = 0; i < estimate.runs.size(); ++i) likelihood.run_weight[i] = estimate.runs[i].weight;
  return likelihood;
}

/// The sum of sensor × body and sensor · body over straight motions.
struct Directions {
  double sine = 0.0, cosine = 0.0, length = 0.0, motions = 0.0;

  void add(const Vector2& sensor, const Vector2& body) {
    sine += sensor.x() * body.y() - sensor.y() * body.x();
    cosine += sensor.dot(body);
    length += sensor.norm() * body.norm();
    motions += 1.0;
  }
};

void add_motions(const Run& run, const Robot& robot, Directions& directions) {
  Robot in_the_middle = robot;
  in_the_middle.body_from_reference = {};
  const RelativeResiduals residuals = relative_residuals(run, in_the_middle, {});
  auto measured = run.relative_motions.begin();
  for (std::size_t i = 0; i < residuals.residual.size(); ++i) {
    while (measured->start_s != residuals.start_s[i]) ++measured;
    const Pose2& motion = measured->motion;
    if (std::abs(motion.heading) < kStraight_rad)
      directions.add(motion.translation(), motion.translation() - residuals.residual[i].head<2>());
    ++measured;
  }
}

}  // namespace

CalibrationProblem with_sensor_pose(CalibrationProblem problem) {
  for (const ParameterKind kind : shown_of_sensor(problem)) problem.parameters.push_back({.kind = kind});
  return problem;
}

std::optional<double> sensor_heading(std::span<const Run> runs, const Robot& robot) {
  Directions directions;
  for (const Run& run : runs) add_motions(run, robot, directions);
  const bool agree = std::hypot(directions.sine, directions.cosine) > kAgree * directions.length;
  if (directions.motions < kFewestDirections || !agree) return std::nullopt;
  return std::atan2(directions.sine, directions.cosine);
}

SensorPlace sensor_place(const CalibrationProblem& problem, const Estimate& estimate) {
  const auto is_free = [&](ParameterKind kind) { return contains(problem.parameters, kind); };
  const auto has_reference = [](const Run& run) { return !run.epochs.empty(); };
  if (std::ranges::any_of(kSensorPose, is_free) || std::ranges::none_of(problem.runs, has_reference))
    return {};
  if (all_places_are_free(problem))
    return {
        .unobservable =
            "reference.x, reference.y, reference.heading: not observable from these runs, for all wheels' "
            "places are estimated: these are as right as [reference_sensor] of the robot file"};
  // Where and how a sideways wheel stands makes up for where the sensor does: the score says nothing.
  if (!owes_headings_to_wheels(problem.nominal)) return {};
  const CalibrationProblem wider = with_sensor_pose(problem);
  const Information all = total_information(likelihood_at(estimate, wider), estimate.robot);
  const Eigen::VectorXd sigma = prior_sigmas(wider.parameters, problem.nominal);
  Eigen::MatrixXd N = sigma.asDiagonal() * all.matrix * sigma.asDiagonal();
  N.diagonal().array() += kNothing;
  const auto shown = static_cast<Eigen::Index>(shown_of_sensor(problem).size());
  N.diagonal().tail(shown).array() += 1.0;  // the prior: what the runs do not show stays
  const Eigen::MatrixXd inverse = inverse_of(N);
  const Eigen::VectorXd step = (inverse * sigma.cwiseProduct(all.gradient)).tail(shown);
  Vector3 offset = Vector3::Zero();
  offset.head(shown) = sigma.tail(shown).cwiseProduct(step);
  const double chi2 =
      step.dot(inverse_of(inverse.bottomRightCorner(shown, shown)) * step) / estimate.dispersion;
  const bool is_seen = offset.head<2>().norm() > kSeen_m || std::abs(offset.z()) > kSeen_rad;
  if (!(chi2 > kElsewhere) || !is_seen) return {};
  const bool looks = shown == 3;
  return {.elsewhere = fmt::format(
              "the references fit better with their sensor {:.3f} m ahead{} {:.3f} m to the left{} of where "
              "[reference_sensor] of the robot file has it",
              offset.x(), looks ? "," : " and", offset.y(),
              looks ? fmt::format(" and {:.1f}° counter-clockwise", degrees(offset.z())) : ""),
          .advice = fmt::format("measure it, or --free reference.x --free reference.y{}",
                                looks ? " --free reference.heading" : "")};
}

}  // namespace trundle::calibration
