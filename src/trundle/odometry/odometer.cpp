#include "trundle/odometry/odometer.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <type_traits>

#include <fmt/format.h>

#include "trundle/io/error.hpp"

namespace trundle::odometry {

static_assert(std::is_trivially_copyable_v<OdometerState>);
static_assert(sizeof(OdometerState) % sizeof(double) == 0);

namespace {

constexpr std::size_t kPair = 2;  // doubles in 16 bytes: the SIMD registers that every target has
using Pair = Eigen::Array<double, kPair, 1>;
static_assert(kMaxWheels % kPair == 0);

/// Turns spread differently over a gap, or bends that cancel, move its end by this much per metre and radian.
constexpr double kUnseenBend_rad = 0.1;

std::string words_of(const Vector3& direction) {
  constexpr std::array<const char*, 3> kNames = {"forward motion", "sideways motion", "turning"};
  const double largest = direction.cwiseAbs().maxCoeff();
  std::string words;
  for (int i = 0; i < 3; ++i) {
    if (std::abs(direction[i]) < 1e-6 * largest) continue;
    words += (words.empty() ? "" : " together with ") + std::string(kNames[static_cast<std::size_t>(i)]);
  }
  return words;
}

}  // namespace

void require_observable(const Robot& robot, bool with_gyro) {
  const Observability seen = observability(rows_of(robot.chassis, with_gyro));
  if (seen.rank == 3) return;
  std::string words;
  for (const Vector3& direction : seen.unobservable)
    words += (words.empty() ? "" : "; ") + words_of(direction);
  throw CannotAnswer(
      fmt::format("robot '{}' cannot determine its motion: no wheel{} measures {}; add a sensor that does",
                  robot.name, with_gyro ? " or gyro" : "", words));
}

double initial_bias_sigma(const Robot& robot) {
  // A few sessions say little of how far a bias drifts from day to day: docs/theory/gyro.md, below eq. 5.
  constexpr double kSessionsShowLittle = 10.0;
  double sigma = robot.chassis.gyro->bias_sigma_rad_s;
  if (!robot.calibration) return sigma;
  for (const CalibratedParameter& parameter : robot.calibration->parameters)
    if (parameter.observable && parameter.name == name_of(kGyroBias, robot))
      sigma = std::max(sigma, kSessionsShowLittle * parameter.sigma_between.value_or(0.0));
  return sigma;
}

Odometer::Odometer(const Robot& robot, const Options& options)
    : gauge_(robot.chassis),
      wheels_(robot.chassis.wheels().size()),
      parameters_(options.parameters.size()),
      uncertain_(parameters_),
      with_covariance_(options.with_covariance),
      rates_change_(options.rates_change),
      steered_(is_steered(robot.chassis)) {
  const Chassis& chassis = robot.chassis;
  for (std::size_t i = 0; i < wheels_; ++i) rounding_variance_[i] = rounding_variance(chassis.wheels()[i]);
  if (parameters_ > kMaxParameters)
    throw InputError(place_of(robot), fmt::format("{} uncertain parameters", parameters_),
                     fmt::format("at most {}", kMaxParameters));
  std::vector<Parameter> parameters = options.parameters;
  learns_ = options.learn_gyro_bias && options.with_covariance && chassis.gyro.has_value();
  if (learns_ && std::ranges::find(parameters, kGyroBias) != parameters.end())
    throw InputError(place_of(robot), "the bias of the gyro is both learned and an uncertain parameter",
                     "one of them");
  if (chassis.gyro) {
    gyro_ = *chassis.gyro;
    parameters.push_back(kGyroBias);
  }
  require_observable(robot, true);
  if (chassis.gyro) with_gyro_.emplace(chassis, parameters, true);
  if (observability(rows_of(chassis, false)).rank == 3) without_gyro_.emplace(chassis, parameters, false);
  state_.pose = options.start;
  state_.white = symmetric_of(options.start_covariance);
  if (!learns_) return;
  rest_.emplace(chassis, options.rest);
  stuck_.emplace(chassis, options.rest);
  const double bias_sigma = initial_bias_sigma(robot);
  state_.bias_variance = state_.untold.variance = state_.untold.with_bias = bias_sigma * bias_sigma;
  gate_ = options.rest.sigmas * options.rest.sigmas;
  if (options.compare_turns && without_gyro_) begin_comparison(robot, options.parameters);
}

Verdict Odometer::judged_step(const Increment& increment) {
  if (increment.has_gyro && std::abs(increment.gyro_rad) > gyro_.max_rate_rad_s * increment.duration_s) {
    Increment usable = increment;
    usable.has_gyro = false;
    Verdict verdict = judged_step(usable);
    verdict.gyro_disturbed = true;
    return verdict;
  }
  trace_ = {};
  if (rest_->continues(state_.rest, increment, gyro_bias()))
    stand_still(increment);
  else
    move_on(increment);
  rest_->follow_counts(state_.rest, increment);
  return {.phase = state_.rest.phase, .stuck = state_.stuck.stuck};
}

/// The pose does not move but by what the wheels still turned before they stood; the bias walks, and what the
/// gyro reads is its bias.
void Odometer::stand_still(const Increment& increment) {
  let_bias_walk(increment.duration_s);
  const std::optional<GyroEvidence> evidence = rest_->add(state_.rest, increment);
  const std::optional<Increment> settled = rest_->settled(state_.rest, increment.time_s);
  if (settled && any_turns(*settled)) advance(*settled);
  if (evidence) learn_bias(*evidence);
  if (state_.rest.phase != RestPhase::resting) return;
  state_.stuck = {};
  end_comparison();  // wheels may turn on a little as they come to stand, the gyro's reading is then left out
}

Triple Odometer::move_on(const Increment& increment) {
  const auto take_bias_out = [&](Increment& reading) {
    reading.gyro_rad -= state_.bias_rad_s * reading.duration_s;
  };
  if (state_.rest.phase != RestPhase::moving) {
    const bool stood = state_.rest.phase == RestPhase::resting;
    Increment withheld = RestDetector::withheld(state_.rest, increment.time_s - increment.duration_s);
    RestDetector::leave(state_.rest);
    state_.stuck.still = {};  // what starts to move gets lag_s to be seen by every sensor
    take_bias_out(withheld);
    if (withheld.duration_s > 0.0 || any_turns(withheld)) advance(withheld);
    if (stood) state_.turn_rate_rad_s = 0.0;  // what goes on unmeasured begins from there
  }
  Increment reading = increment;
  take_bias_out(reading);
  stuck_->watch(state_.stuck, reading, gyro_bias(), state_.rolling.octave);
  return advance(reading);
}

Triple Odometer::advance(const Increment& increment) {
  const MotionModel* model = model_for(increment);
  if (!model) return advance_unmeasured(increment);
  if (with_covariance_) return advance_with_covariance(*model, increment);
  const Triple twist = model->twist(increment, state_.rolling.octave);
  if (!model->square())
    gauge_.follow(state_.rolling, gauge_.add(state_.rolling, increment), increment.duration_s);
  state_.pose = moved(state_.pose, twist);
  if (!without_gyro_ && increment.duration_s > 0.0) state_.turn_rate_rad_s = twist[2] / increment.duration_s;
  return twist;
}

/// As if the gyro had gone on reading the last turn rate, with the uncertainty of that.
Triple Odometer::advance_unmeasured(const Increment& increment) {
  Increment assumed = increment;
  assumed.has_gyro = true;
  const double rate = state_.turn_rate_rad_s;
  assumed.gyro_rad = (rate / gyro_.scale + gyro_.bias_rad_s) * increment.duration_s;
  const double heading = state_.pose.heading;
  const Triple twist = advance(assumed);
  state_.turn_rate_rad_s = rate;
  if (with_covariance_) {
    const Triple change =
        ArcStep(heading, twist).map(with_gyro_->response_to_turn(assumed, state_.rolling.octave));
    add_outer(state_.white, kUnmeasuredTurn * kUnmeasuredTurn * increment.duration_s, change);
  }
  return twist;
}

Triple Odometer::advance_with_covariance(const MotionModel& model, const Increment& increment) {
  TwistStep step;
  const Rolled rolled = gauge_.add(state_.rolling, increment);
  // The octave is that of the motion before: it does not depend on these readings.
  model.twist_with_covariance(increment, rolled, state_.rolling.octave, step);
  if (!model.square()) gauge_.follow(state_.rolling, rolled, increment.duration_s);
  const ArcStep arc(state_.pose.heading, step.twist);
  state_.white = arc.carry(state_.white, step.covariance);
  carry_rounding(arc, increment, step);
  for (std::size_t j = 0; j < parameters_; ++j) {
    const Triple carried = arc.carry(state_.sensitivity[j]);
    const Triple added = arc.map(step.derivative[j]);
    for (std::size_t i = 0; i < 3; ++i) state_.sensitivity[j][i] = carried[i] + added[i];
  }
  if (state_.wheels_told)
    for (std::size_t j = parameters_; j < uncertain_; ++j)
      state_.sensitivity[j] = arc.carry(state_.sensitivity[j]);
  if (with_gyro_) {
    const Triple by_bias = arc.map(step.derivative[parameters_]);
    if (learns_) trace_arc(arc, by_bias);
    add_bias(arc, by_bias, increment.duration_s);
  }
  Pose2& pose = state_.pose;
  pose = {pose.x + arc.chord().x, pose.y + arc.chord().y, pose.heading + step.twist[2]};
  if (rates_change_) bend(arc, step.twist, increment.duration_s);
  if (!without_gyro_ && increment.duration_s > 0.0)
    state_.turn_rate_rad_s = step.twist[2] / increment.duration_s;
  if (turns_ && !state_.rested) compare_turns(model, increment, rolled);
  return step.twist;
}

/// Where rates change linearly, by the slope from the interval before, the path ends beside its arc.
void Odometer::bend(const ArcStep& arc, const Triple& twist, double duration_s) {
  if (duration_s <= 0.0) return;
  const MeanRates before = state_.rates;
  for (std::size_t i = 0; i < 3; ++i) state_.rates.per_s[i] = twist[i] / duration_s;
  state_.rates.duration_s = duration_s;
  if (before.duration_s == 0.0) return;
  const auto [forward, sideways, turning] = before.per_s;
  const double share = duration_s * duration_s / (6.0 * (duration_s + before.duration_s));
  const Triple beside = arc.map(Triple{share * (twist[2] * sideways - turning * twist[1]),
                                       share * (turning * twist[0] - twist[2] * forward), 0.0});
  state_.pose.x += beside[0];
  state_.pose.y += beside[1];
}

/// A count that falls brings a new rounding error and takes the old one back: docs/theory/odometry.md,
/// eq. 10. Two wheels at a time; those that are none have no variance.
void Odometer::carry_rounding(const ArcStep& arc, const Increment& increment, const TwistStep& step) {
  WheelVectors& by_rounding = state_.by_rounding;
  const WheelVectors& by_travel = step.by_travel;
  for (std::size_t i = 0; i < wheels_; i += kPair) {
    const auto at = [i](const std::array<double, kMaxWheels>& column) -> Pair {
      return Eigen::Map<const Pair>(&column[i]);
    };
    const ArcStep::Vectors<Pair> before =
        arc.carry(ArcStep::Vectors<Pair>{at(by_rounding.x), at(by_rounding.y), at(by_rounding.h)});
    const ArcStep::Vectors<Pair> now =
        arc.map(ArcStep::Vectors<Pair>{at(by_travel.x), at(by_travel.y), at(by_travel.h)});
    const auto falls = (at(increment.turned) != 0.0).eval();
    const Pair variance = falls.select(at(rounding_variance_), 0.0);
    const Pair dx = before.x - now.x, dy = before.y - now.y, dh = before.h - now.h;
    const Pair vx = variance * dx, vy = variance * dy;
    const Pair added[] = {vx * dx, vx * dy, vx * dh, vy * dy, vy * dh, variance * dh * dh};
    for (std::size_t k = 0; k < 6; ++k) state_.white[k] += added[k][0] + added[k][1];
    const auto keep = [i](const Pair& pair, std::array<double, kMaxWheels>& column) {
      Eigen::Map<Pair>{&column[i]} = pair;
    };
    keep(falls.select(now.x, before.x), by_rounding.x);
    keep(falls.select(now.y, before.y), by_rounding.y);
    keep(falls.select(now.h, before.h), by_rounding.h);
  }
}

Symmetric3 Odometer::rounding() const {
  Symmetric3 rounding{};
  const WheelVectors& b = state_.by_rounding;
  for (std::size_t i = 0; i < wheels_; ++i)
    add_outer(rounding, rounding_variance_[i], {b.x[i], b.y[i], b.h[i]});
  return rounding;
}

Symmetric3 Odometer::white() const {
  Symmetric3 white = state_.white;
  add(white, rounding());
  // E[(½ bend b²)²] = ¾ bend² B²: docs/theory/redundant-turn.md, eq. 5
  add_outer(white, 0.75 * state_.bias_variance * state_.bias_variance, {state_.bend[0], state_.bend[1], 0.0});
  if (state_.wheels_told) add(white, through_bias());
  return white;
}

void Odometer::correct(const Vector3& step, const Matrix3& keep, const Matrix3& noise,
                       const PoseSensitivity& sensitivity) {
  const auto kept = [&](Triple& column) {
    Eigen::Map<Vector3> vector(column.data());
    vector = (keep * vector).eval();
  };
  state_.pose = {state_.pose.x + step.x(), state_.pose.y + step.y(), state_.pose.heading + step.z()};
  state_.white = symmetric_of(keep * full_matrix(state_.white) * keep.transpose() + noise);
  kept(state_.bias);
  WheelVectors& b = state_.by_rounding;
  for (std::size_t i = 0; i < wheels_; ++i) {
    const Vector3 carried = keep * Vector3(b.x[i], b.y[i], b.h[i]);
    b.x[i] = carried.x(), b.y[i] = carried.y(), b.h[i] = carried.z();
  }
  for (std::size_t j = 0; j < parameters_; ++j)
    Eigen::Map<Vector3>(state_.sensitivity[j].data()) = sensitivity.col(static_cast<Eigen::Index>(j));
}

void Odometer::restart() {
  const Matrix2 to_body = rotation(state_.pose.heading).transpose();
  WheelVectors& b = state_.by_rounding;
  for (std::size_t i = 0; i < wheels_; ++i) {
    const Vector2 turned = to_body * Vector2(b.x[i], b.y[i]);
    b.x[i] = turned.x(), b.y[i] = turned.y();
  }
  state_.pose = {};
  state_.white = {};
  state_.bias = {};
  state_.bend = {};
  state_.difference.with_pose = {};
  state_.untold.with_pose = {};
  state_.sensitivity = {};
}

void Odometer::trace_arc(const ArcStep& arc, const Triple& by_bias) {
  const Triple carried = arc.carry(trace_.by_bias);
  for (std::size_t i = 0; i < 3; ++i) trace_.by_bias[i] = carried[i] + by_bias[i];
  trace_.displacement[0] += arc.chord().x;
  trace_.displacement[1] += arc.chord().y;
}

void Odometer::step_across_gap(const Increment& increment) {
  trace_ = {};
  state_.rates = {};
  const Triple twist = learns_ ? move_on(increment) : advance(increment);
  state_.rates = {};
  end_comparison();
  if (learns_) rest_->follow_counts(state_.rest, increment);
  if (!with_covariance_) return;
  const double sigma =
      std::hypot(twist[0], twist[1]) * (std::abs(twist[2]) + kUnseenBend_rad) / std::sqrt(12.0);
  state_.white[0] += sigma * sigma;
  state_.white[3] += sigma * sigma;
  if (steered_ && !(with_gyro_ && increment.has_gyro))
    state_.white[5] += kUnmeasuredTurn * kUnmeasuredTurn * increment.duration_s;
}

PoseSensitivity Odometer::sensitivity() const {
  PoseSensitivity J(3, parameters_);
  for (std::size_t j = 0; j < parameters_; ++j)
    J.col(static_cast<Eigen::Index>(j)) = Eigen::Map<const Vector3>(state_.sensitivity[j].data());
  return J;
}

Matrix3 parameter_covariance(const PoseSensitivity& sensitivity, const Eigen::MatrixXd& covariance) {
  return sensitivity * covariance * sensitivity.transpose();
}

}  // namespace trundle::odometry
