#include "trundle/simulation/sensors.hpp"

#include <algorithm>
#include <cmath>

#include "trundle/io/interruption.hpp"
#include "trundle/simulation/streams.hpp"

namespace trundle::simulation {
namespace {

/// Follows a drive forwards in time: the pose at any later moment, exact because the twist is constant in
/// between.
class Follower {
 public:
  explicit Follower(const Drive& drive) : moments_(drive.moments) {}

  Pose2 at(double time_s) {
    while (next_ + 1 < moments_.size() && moments_[next_].time_s < time_s) ++next_;
    const Moment& after = moments_[next_];
    if (next_ == 0 || time_s >= after.time_s) return after.body;
    const Moment& before = moments_[next_ - 1];
    const double u = (time_s - before.time_s) / (after.time_s - before.time_s);
    const Twist2 step = log(before.body.inverse() * after.body);
    return before.body * exp({u * step.dx, u * step.dy, u * step.dtheta});
  }

 private:
  const std::vector<Moment>& moments_;
  std::size_t next_ = 0;
};

/// Calls f(true time) at a rate, from 0 to the end of the drive.
template <typename F>
void at_rate(double rate_hz, const Drive& drive, F f) {
  const double end = drive.moments.back().time_s;
  for (int k = 0; rate_hz > 0.0 && k / rate_hz <= end + 1e-9; ++k) {
    check_interruption();
    f(k / rate_hz);
  }
}

double wrapped_count(double count, int bits) {
  const double range = std::ldexp(1.0, bits);
  const double remainder = std::fmod(count, range);
  return remainder < 0.0 ? remainder + range : remainder;
}

double ticks_of(const EncoderOptions& options, const Wheel& wheel, double turned) {
  double count = turned * wheel.ticks_per_revolution;
  if (options.quantised) count = std::round(count);
  return options.wrapped && wheel.tick_bits > 0 ? wrapped_count(count, wheel.tick_bits) : count;
}

/// What the robot's own software takes a revolution for [m].
double recorded_circumference(const Wheel& nominal) {
  return kPi * (nominal.recorded_diameter_m > 0.0 ? nominal.recorded_diameter_m : nominal.diameter_m);
}

/// Moments at the encoders' sampling times.
std::vector<const Moment*> samples_of(const EncoderOptions& options, const Drive& drive) {
  std::vector<const Moment*> samples;
  auto moment = drive.moments.begin();
  at_rate(options.rate_hz, drive, [&](double t) {
    while (moment->time_s < t - 0.5e-9) ++moment;
    samples.push_back(&*moment);
  });
  return samples;
}

/// What the encoder reports after `turned` revolutions, `before` at the sample before.
double encoder_value(const Scenario& scenario, std::size_t w, double turned, double before) {
  const EncoderOptions& options = scenario.encoders;
  if (options.unit == WheelUnit::ticks) return ticks_of(options, scenario.truth.chassis.wheels()[w], turned);
  if (options.unit == WheelUnit::metres)
    return turned * recorded_circumference(scenario.nominal.chassis.wheels()[w]);
  if (options.unit == WheelUnit::rate) return (turned - before) * 2.0 * kPi * options.rate_hz;
  return turned * 2.0 * kPi;
}

WheelSeries series_of(const Scenario& scenario, std::size_t w, const std::vector<const Moment*>& samples) {
  WheelSeries series{scenario.nominal.wheel_names[w], scenario.encoders.unit, {}};
  double before = 0.0;
  for (const Moment* sample : samples) {
    series.value.push_back(encoder_value(scenario, w, sample->turned[w], before));
    before = sample->turned[w];
  }
  return series;
}

bool in_gap(const std::vector<TimeSpan>& gaps, double time_s) {
  return std::ranges::any_of(gaps,
                             [&](const TimeSpan& g) { return time_s > g.start_s && time_s < g.end_s(); });
}

/// First-order Gauss–Markov: e ← φ e + σ √(1 − φ²) n, φ = exp(−Δt/τ).
class Wander {
 public:
  Wander(const ReferenceOptions& options, Random& random)
      : sigma_(options.wander_sigma_m),
        phi_(std::exp(-1.0 / (options.rate_hz * options.wander_time_s))),
        random_(random),
        error_{random.normal(sigma_), random.normal(sigma_)} {}

  Vector2 next() {
    const Vector2 now = error_;
    const double sigma = sigma_ * std::sqrt(1.0 - phi_ * phi_);
    error_ = {phi_ * now.x() + random_.normal(sigma), phi_ * now.y() + random_.normal(sigma)};
    return now;
  }

 private:
  double sigma_;
  double phi_;
  Random& random_;
  Vector2 error_;
};

Vector2 position_error(const ReferenceOptions& options, Random& random) {
  // One after the other: arguments of a function are evaluated in an order that each compiler chooses.
  Vector2 error;
  for (const int axis : {1, 0}) error[axis] = random.normal(options.position_sigma_m);
  if (options.outlier_share > 0.0 && random.uniform() < options.outlier_share)
    for (const int axis : {1, 0}) error[axis] += random.uniform(-1.0, 1.0) * options.outlier_m;
  return error;
}

struct View {
  double range_m = 0.0;
  double bearing_rad = 0.0;
};

View view_of(const Vector2& landmark_in_sensor) {
  return {landmark_in_sensor.norm(), std::atan2(landmark_in_sensor.y(), landmark_in_sensor.x())};
}

template <typename T>
void shuffle(std::vector<T>& items, Random& random) {
  for (std::size_t i = items.size(); i > 1; --i) std::swap(items[i - 1], items[random.below(i)]);
}

std::vector<Sighting> look_around(const Scenario& scenario, const Pose2& world_from_sensor, double stamp_s,
                                  Random& random) {
  const LandmarkSensor& sensor = *scenario.truth.landmark_sensor;
  const SightingOptions& options = scenario.sightings;
  const Pose2 sensor_from_world = world_from_sensor.inverse();
  std::vector<Sighting> seen;
  for (const Landmark& landmark : scenario.landmarks) {
    const View view = view_of(sensor_from_world * landmark.position);
    if (view.range_m > sensor.max_range_m || view.range_m == 0.0) continue;
    if (std::abs(view.bearing_rad) > 0.5 * options.field_of_view_rad) continue;
    if (options.detection < 1.0 && random.uniform() >= options.detection) continue;
    const double read_rad = view.bearing_rad + sensor.bearing_offset_rad;
    const double range = std::max(0.0, sensor.range_scale * sensor.along_ray(read_rad) * view.range_m +
                                           sensor.range_offset_m + random.normal(sensor.range_sigma_m));
    const double bearing = wrap_angle(read_rad + random.normal(sensor.bearing_sigma_rad));
    seen.push_back({stamp_s, options.hide_names ? "" : landmark.name, range, bearing});
  }
  if (options.hide_names) shuffle(seen, random);
  return seen;
}

Measured measured(double truth, double sigma, Random& random) {
  return {truth + random.normal(sigma), sigma};
}

}  // namespace

WheelStream read_encoders(const Scenario& scenario, const Drive& drive) {
  WheelStream stream;
  const auto samples = samples_of(scenario.encoders, drive);
  const double shift = scenario.start_s - scenario.truth.chassis.wheels_time_offset_s;
  for (const Moment* sample : samples) stream.time_s.push_back(sample->time_s + shift);
  for (std::size_t w = 0; w < scenario.truth.chassis.wheels().size(); ++w)
    stream.series.push_back(series_of(scenario, w, samples));
  return stream;
}

VelocityStream read_velocity(const Scenario& scenario, const Drive& drive) {
  VelocityStream stream;
  const double rate = scenario.encoders.rate_hz;
  const double shift = scenario.start_s - scenario.truth.chassis.wheels_time_offset_s;
  const Moment* before = &drive.moments.front();
  for (const Moment* sample : samples_of(scenario.encoders, drive)) {
    stream.time_s.push_back(sample->time_s + shift);
    stream.forward_m_s.push_back((sample->turned[0] - before->turned[0]) * rate);
    stream.yaw_rate_rad_s.push_back((sample->turned[1] - before->turned[1]) * rate);
    before = sample;
  }
  return stream;
}

GyroReadings read_gyro(const Scenario& scenario, const Drive& drive) {
  if (!scenario.truth.chassis.gyro) return {};
  const Gyro& gyro = *scenario.truth.chassis.gyro;
  const double rate = scenario.gyro.rate_hz;
  const double sigma = gyro.noise_rad_s_sqrt_hz * std::sqrt(rate);
  const double step_sigma = gyro.bias_walk_rad_s_sqrt_s / std::sqrt(rate);
  Random white = random_for(scenario.seed, RandomStream::gyro);
  Random walk = random_for(scenario.seed, RandomStream::gyro_bias);
  GyroReadings readings{{}, gyro.bias_rad_s};
  Follower robot(drive);
  double heading = scenario.start.heading;
  at_rate(rate, drive, [&](double t) {
    const double now = robot.at(t).heading;
    const double reading =
        (now - heading) * rate / gyro.scale + readings.last_bias_rad_s + white.normal(sigma);
    readings.stream.time_s.push_back(t + scenario.start_s - gyro.time_offset_s);
    readings.stream.yaw_rate_rad_s.push_back(std::clamp(reading, -gyro.max_rate_rad_s, gyro.max_rate_rad_s));
    readings.last_bias_rad_s += walk.normal(step_sigma);
    heading = now;
  });
  return readings;
}

ReferenceStream read_reference(const Scenario& scenario, const Drive& drive) {
  const ReferenceOptions& options = scenario.reference;
  ReferenceStream stream;
  if (options.rate_hz <= 0.0) return stream;
  Random random = random_for(scenario.seed, RandomStream::reference);
  Wander wander(options, random);
  Follower robot(drive);
  at_rate(options.rate_hz, drive, [&](double t) {
    const Pose2 sensor = robot.at(t) * scenario.truth.body_from_reference;
    const Vector2 position = sensor.translation() + position_error(options, random) + wander.next();
    const double heading = sensor.heading + random.normal(options.heading_sigma_rad);
    if (in_gap(options.gaps, t)) return;
    stream.time_s.push_back(t + scenario.start_s - scenario.truth.reference_time_offset_s);
    stream.x_m.push_back(position.x());
    stream.y_m.push_back(position.y());
    stream.heading_rad.push_back(options.with_heading ? heading : kNotMeasured);
  });
  return stream;
}

PartialReference read_partial_reference(const Scenario& scenario, const Drive& drive) {
  const PartialReferenceOptions& options = scenario.partial;
  const Pose2& S = scenario.truth.body_from_reference;
  const Pose2 end = (drive.moments.front().body * S).inverse() * drive.moments.back().body * S;
  Random random = random_for(scenario.seed, RandomStream::partial);
  PartialReference partial;
  if (options.closed) {
    partial.closed = Measured{0.0, options.position_sigma_m};
    partial.closed_heading = Measured{0.0, options.heading_sigma_rad};
  }
  if (options.end_pose) {
    partial.end_x_m = measured(end.x, options.position_sigma_m, random);
    partial.end_y_m = measured(end.y, options.position_sigma_m, random);
    partial.end_heading_rad = measured(end.heading, options.heading_sigma_rad, random);
  }
  if (options.distance)
    partial.distance_m = measured(end.translation().norm(), options.position_sigma_m, random);
  if (options.turns)
    partial.turns = measured(end.heading / (2.0 * kPi), options.heading_sigma_rad / (2.0 * kPi), random);
  return partial;
}

std::vector<Sighting> read_sightings(const Scenario& scenario, const Drive& drive) {
  std::vector<Sighting> sightings;
  if (!scenario.truth.landmark_sensor) return sightings;
  const LandmarkSensor& sensor = *scenario.truth.landmark_sensor;
  Random random = random_for(scenario.seed, RandomStream::sightings);
  Follower robot(drive);
  at_rate(scenario.sightings.rate_hz, drive, [&](double t) {
    const double stamp = t + scenario.start_s - sensor.time_offset_s;
    const auto seen = look_around(scenario, robot.at(t) * sensor.body_from_sensor, stamp, random);
    sightings.insert(sightings.end(), seen.begin(), seen.end());
  });
  return sightings;
}

}  // namespace trundle::simulation
