// Source 2's drive with wheels that spin often: a simulation of its own, exact arcs and white roll noise, and
// the source's rule computed beside the library.
#include <algorithm>
#include <cmath>

#include <fmt/core.h>
#include <gtest/gtest.h>

#include "trundle/slip/find_slip.hpp"
#include "trundle/statistics/random.hpp"

#include "chassis/robots.hpp"
#include "scale.hpp"

namespace trundle::slip {
namespace {

constexpr double kTrack_m = 0.5;
constexpr double kInterval_s = 0.25;
constexpr double kTravel_m = 0.0625;  // in an interval, 0.25 m/s
constexpr int kIntervals = 160;       // 10 m
constexpr double kRollNoise = 0.001;  // [√m]
constexpr double kGyroNoise = 3e-4;   // [rad/√s]
constexpr double kBias = 1e-4;        // [rad/s], what 10 s of rest leave of it
constexpr double kBand = 2.5758;      // sigmas: 1 %

/// What a motor does whose wheel spins.
enum class Motor {
  holds_rate,  ///< the ground falls behind, the robot swerves
  runs_away,   ///< the robot goes straight on
};

struct Sample {
  std::array<double, 2> wheel_m{};
  double gyro_rad = 0.0;
  int slips = -1;
};

struct SlippingDrive {
  std::vector<Sample> samples;
  Pose2 end;
  double path_m = 0.0;
};

Pose2 moved(const Pose2& pose, double left_m, double right_m) {
  return pose * exp(Twist2{0.5 * (left_m + right_m), 0.0, (right_m - left_m) / kTrack_m});
}

/// Slips of 0.5 to 2 s, of one wheel each, with pauses so that they take the wanted share of the time.
std::vector<int> slipping_wheels(double share, Random& random) {
  std::vector<int> wheel;
  bool slips = random.uniform(0.0, 1.0) < share;
  while (wheel.size() < kIntervals) {
    const double slip_s = random.uniform(0.5, 2.0);
    const double length_s = slips ? slip_s : slip_s * (1.0 - share) / share;
    const int which = slips ? static_cast<int>(random.below(2)) : -1;
    for (int k = 0; k < std::max(1, static_cast<int>(std::lround(length_s / kInterval_s))); ++k)
      wheel.push_back(which);
    slips = !slips;
  }
  wheel.resize(kIntervals);
  return wheel;
}

/// `skids`: share of the slips in which the wheel falls behind instead.
SlippingDrive drive_of(double share, Motor motor, double most, std::uint64_t seed, double skids = 0.0) {
  Random random(seed);
  SlippingDrive drive;
  const double bias_rad_s = random.normal(kBias);
  const std::vector<int> slipping = slipping_wheels(share, random);
  double factor = 1.0;
  for (int k = 0; k < kIntervals; ++k) {
    const int slips = slipping[static_cast<std::size_t>(k)];
    if (k == 0 || slips != slipping[static_cast<std::size_t>(k - 1)]) {
      factor = random.uniform(1.1, most);
      if (random.uniform(0.0, 1.0) < skids) factor = 1.0 / factor;
    }
    std::array<double, 2> ground{kTravel_m, kTravel_m};
    if (slips >= 0 && motor == Motor::holds_rate) ground[static_cast<std::size_t>(slips)] /= factor;
    Sample sample{.wheel_m = ground, .slips = slips};
    if (slips >= 0) sample.wheel_m[static_cast<std::size_t>(slips)] *= factor;
    for (double& m : sample.wheel_m) m += random.normal(kRollNoise * std::sqrt(m));
    sample.gyro_rad = (ground[1] - ground[0]) / kTrack_m + bias_rad_s * kInterval_s +
                      random.normal(kGyroNoise * std::sqrt(kInterval_s));
    drive.samples.push_back(sample);
    drive.end = moved(drive.end, ground[0], ground[1]);
    drive.path_m += 0.5 * (ground[0] + ground[1]);
  }
  return drive;
}

Robot robot() {
  Robot robot =
      test::robot_of(differential_drive({.diameter_m = 0.15, .ticks_per_revolution = 0.0}, kTrack_m));
  robot.chassis.gyro = Gyro{.noise_rad_s_sqrt_hz = kGyroNoise, .bias_sigma_rad_s = kBias};
  robot.chassis.noise.wheel_per_sqrt_m = kRollNoise;
  return robot;
}

AlignedReadings readings_of(const SlippingDrive& drive, const Robot& robot) {
  AlignedReadings readings;
  for (const Sample& sample : drive.samples) {
    Increment increment;
    increment.duration_s = kInterval_s;
    increment.time_s = kInterval_s * static_cast<double>(readings.increments.size() + 1);
    for (std::size_t i = 0; i < 2; ++i)
      increment.turned[i] = sample.wheel_m[i] / (kPi * robot.chassis.wheels()[i].diameter_m);
    increment.gyro_rad = sample.gyro_rad;
    increment.has_gyro = true;
    readings.increments.push_back(increment);
  }
  return readings;
}

double squared(double x) {
  return x * x;
}

/// Wheels and gyro, weighted with their variances, in an interval without slip.
Pose2 fused(const Pose2& pose, const Sample& s) {
  const double by_wheels = (s.wheel_m[1] - s.wheel_m[0]) / kTrack_m;
  const double wheels_variance = squared(kRollNoise) * (s.wheel_m[0] + s.wheel_m[1]) / squared(kTrack_m);
  const double gyro_variance = squared(kGyroNoise) * kInterval_s;
  const double turn =
      (by_wheels * gyro_variance + s.gyro_rad * wheels_variance) / (gyro_variance + wheels_variance);
  return pose * exp(Twist2{0.5 * (s.wheel_m[0] + s.wheel_m[1]), 0.0, turn});
}

Pose2 end_of_wheels(const SlippingDrive& drive) {
  Pose2 pose;
  for (const Sample& s : drive.samples) pose = moved(pose, s.wheel_m[0], s.wheel_m[1]);
  return pose;
}

Pose2 end_of_fusion(const SlippingDrive& drive) {
  Pose2 pose;
  for (const Sample& s : drive.samples) pose = fused(pose, s);
  return pose;
}

/// Forwards, wheels that spin: above the band it is the right wheel, below it the left one; its travel is
/// that of the other one and B tan g, the turn is the gyro's.
Pose2 end_of_rule(const SlippingDrive& drive) {
  Pose2 pose;
  for (const Sample& s : drive.samples) {
    const double delta = (s.wheel_m[1] - s.wheel_m[0]) / kTrack_m - s.gyro_rad;
    const double sigma = std::sqrt(squared(kRollNoise) * (s.wheel_m[0] + s.wheel_m[1]) / squared(kTrack_m) +
                                   squared(kGyroNoise) * kInterval_s);
    const bool straight = std::abs(s.wheel_m[1] - s.wheel_m[0]) < 0.2 * (s.wheel_m[0] + s.wheel_m[1]);
    if (std::abs(delta) <= kBand * sigma || !straight) {
      pose = fused(pose, s);
      continue;
    }
    double left = s.wheel_m[0], right = s.wheel_m[1];
    (delta > 0.0 ? right : left) = std::max(
        0.0, delta > 0.0 ? left + kTrack_m * std::tan(s.gyro_rad) : right - kTrack_m * std::tan(s.gyro_rad));
    pose = pose * exp(Twist2{0.5 * (left + right), 0.0, s.gyro_rad});
  }
  return pose;
}

struct Errors {
  std::vector<double> wheels, fusion, general, published, rule;  ///< at the end [m]
};

struct SlipTally {
  int named = 0, ambiguous = 0, wrong = 0;

  double share(int n) const { return 100.0 * n / std::max(1, named + ambiguous + wrong); }
};

void attribute(const SlipReport& report, const SlippingDrive& drive, SlipTally& tally) {
  for (const SlipEvent& event : report.events) {
    std::array<int, 3> votes{};  // none, left, right
    for (std::size_t k = 0; k < drive.samples.size(); ++k) {
      const double middle_s = kInterval_s * (static_cast<double>(k) + 0.5);
      if (middle_s > event.start_s && middle_s < event.end_s)
        ++votes[static_cast<std::size_t>(drive.samples[k].slips + 1)];
    }
    if (votes[1] + votes[2] == 0) continue;  // a false alarm
    const int truth = votes[2] > votes[1] ? 1 : 0;
    ++(event.wheel == kAmbiguous ? tally.ambiguous : event.wheel == truth ? tally.named : tally.wrong);
  }
}

double median(std::vector<double> values) {
  std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2));
  return values[values.size() / 2];
}

Errors errors_with(double share, Motor motor, double most, SlipTally& general, SlipTally& published) {
  Errors errors;
  const auto seeds = static_cast<std::uint64_t>(test::trials(200));
  const Robot source = robot();
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    const SlippingDrive drive = drive_of(share, motor, most, seed);
    const AlignedReadings readings = readings_of(drive, source);
    const auto error = [&](const Pose2& end) { return (end.translation() - drive.end.translation()).norm(); };
    const SlipReport by_general = find_slip(readings, {}, source, {});
    const SlipReport by_published = find_slip(readings, {}, source, {.method = SlipMethod::published});
    errors.wheels.push_back(error(end_of_wheels(drive)));
    errors.fusion.push_back(error(end_of_fusion(drive)));
    errors.general.push_back(error(by_general.end));
    errors.published.push_back(error(by_published.end));
    errors.rule.push_back(error(end_of_rule(drive)));
    attribute(by_general, drive, general);
    attribute(by_published, drive, published);
  }
  return errors;
}

void expect_the_rules_result(const char* motor_name, Motor motor, double most) {
  fmt::print("  {}: median end error [m]; general, published: right, ambiguous, wrong [%]\n", motor_name);
  fmt::print("  {:>9} {:>8} {:>8} {:>8} {:>9} {:>8}\n", "slipping", "wheels", "fusion", "general",
             "published", "rule");
  for (const double share : {0.2, 0.5, 0.7}) {
    SlipTally general, published;
    const Errors e = errors_with(share, motor, most, general, published);
    const double rule = median(e.rule);
    fmt::print(
        "  {:7.0f} % {:8.3f} {:8.3f} {:8.4f} {:9.4f} {:8.4f}   {:.1f} {:.1f} {:.1f}, {:.1f} {:.1f} {:.1f}\n",
        100.0 * share, median(e.wheels), median(e.fusion), median(e.general), median(e.published), rule,
        general.share(general.named), general.share(general.ambiguous), general.share(general.wrong),
        published.share(published.named), published.share(published.ambiguous),
        published.share(published.wrong));
    EXPECT_LE(median(e.published), 1.2 * rule);
    EXPECT_LE(median(e.general), 2.0 * rule);
    EXPECT_LE(general.share(general.wrong), 1.0);
  }
}

TEST(FrequentSlip, OfMotorsThatHoldTheirRate) {
  expect_the_rules_result("motors hold their rate, factors 1.1 to 2", Motor::holds_rate, 2.0);
}

// Beyond 1.5 times the ground's travel the published method does not apply.
TEST(FrequentSlip, OfWheelsThatRunAway) {
  expect_the_rules_result("wheels run away, factors 1.1 to 1.45", Motor::runs_away, 1.45);
}

// A population as the odds describe it, nothing known before: of what is named with confidence c, a share c
// is right.
TEST(FrequentSlip, ConfidenceIsTheShareThatIsRight) {
  const Robot source = robot();
  double confidence = 0.0, variance = 0.0;
  int named = 0, right = 0;
  const auto seeds = static_cast<std::uint64_t>(test::trials(4000, 400));
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    SlippingDrive drive = drive_of(1.0, Motor::runs_away, 1.45, seed, 1.0 / 11.0);
    const auto end = std::ranges::find_if(
        drive.samples, [&](const Sample& s) { return s.slips != drive.samples.front().slips; });
    drive.samples.erase(end, drive.samples.end());
    const SlipReport report = find_slip(readings_of(drive, source), {}, source, {});
    for (const SlipEvent& event : report.events) {
      if (event.wheel == kAmbiguous) continue;
      ++named;
      confidence += event.confidence;
      variance += event.confidence * (1.0 - event.confidence);
      right += event.wheel == drive.samples.front().slips ? 1 : 0;
    }
  }
  fmt::print("  {} named, {} right, {:.1f} by their confidence\n", named, right, confidence);
  ASSERT_GT(named, 100);
  EXPECT_NEAR(right, confidence, 4.0 * std::sqrt(variance));
}

}  // namespace
}  // namespace trundle::slip
