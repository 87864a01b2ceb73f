// What the detector promises about false alarms and power, against the model's own curves: closed forms for
// one interval, a Markov chain for the cumulative sums.
#include <cmath>
#include <numeric>
#include <vector>

#include <Eigen/Dense>
#include <fmt/core.h>
#include <gtest/gtest.h>

#include "trundle/slip/find_slip.hpp"
#include "trundle/slip/learn.hpp"
#include "trundle/statistics/distribution.hpp"
#include "trundle/statistics/random.hpp"

#include "chassis/robots.hpp"
#include "scale.hpp"

namespace trundle::slip {
namespace {

constexpr double kQuarter_s = 0.25;

/// Noise that does not depend on what is read: rates of wheels that roll far within their noise.
Chassis quiet(Chassis chassis) {
  for (Wheel& wheel : chassis.wheels()) wheel.ticks_per_revolution = 0.0;
  chassis.noise.wheel_per_sqrt_m = 0.001;
  chassis.gyro = Gyro{.noise_rad_s_sqrt_hz = 3e-4};
  return chassis;
}

Robot quiet_differential() {
  return test::robot_of(quiet(differential_drive(test::kSize, 0.5)));
}

/// The same with noise that does not grow where a wheel slips: that of the gyro alone.
Robot differential_with_constant_noise() {
  Robot robot = quiet_differential();
  robot.chassis.noise.wheel_per_sqrt_m = 0.0;
  robot.chassis.gyro->noise_rad_s_sqrt_hz = 3e-3;
  return robot;
}

Robot mecanum_with_pods() {
  return test::robot_of(quiet(test::joined(mecanum(test::kSize, 0.4, 0.5), test::two_pods())));
}

/// Intervals of one motion with Gaussian noise of the variances that the robot file states.
class CleanDriving {
 public:
  CleanDriving(const Robot& robot, const Twist2& motion, std::uint64_t seed)
      : chassis_(robot.chassis), clean_(test::increment_of(chassis_, motion, kQuarter_s)), random_(seed) {
    const Rows rows = rows_of(chassis_, true);
    const Readings readings = readings_of(chassis_, rows, clean_);
    for (int i = 0; i < rows.measured; ++i) sigma_.push_back(std::sqrt(readings.variance[i]));
  }

  Increment next() {
    Increment increment = clean_;
    increment.time_s = kQuarter_s * ++intervals_;
    for (std::size_t i = 0; i < chassis_.wheels().size(); ++i)
      increment.turned[i] += random_.normal(sigma_[i]) / (kPi * chassis_.wheels()[i].diameter_m);
    increment.gyro_rad += random_.normal(sigma_.back()) / chassis_.gyro->scale;
    return increment;
  }

 private:
  Chassis chassis_;
  Increment clean_;
  Random random_;
  std::vector<double> sigma_;
  int intervals_ = 0;
};

const Twist2 kStraight{0.0625, 0.0, 0.0};

GyroBias known_bias(const Robot& robot) {
  return {robot.chassis.gyro->bias_rad_s, 0.0};
}

/// A count of `trials` with probability p lies within this of its mean, but for one case in 1/(1 − level).
double binomial_spread(double p, double trials, double level) {
  p = std::clamp(p, 0.0, 1.0);
  return normal_limit(1.0 - level) * std::sqrt(trials * p * (1.0 - p)) + 1.0;
}

void expect_share(double count, double trials, double p, double level, const std::string& what) {
  EXPECT_NEAR(count, trials * p, binomial_spread(p, trials, level)) << what;
}

void expect_false_alarms(const Robot& robot, const Twist2& motion, int intervals) {
  const Parity parity(robot);
  CleanDriving driving(robot, motion, 1);
  const std::array<double, 3> p = {1e-2, 1e-3, 1e-4};
  std::array<double, 3> limit{};
  std::array<int, 3> alarms{};
  for (std::size_t k = 0; k < p.size(); ++k) limit[k] = chi_squared_limit(p[k], parity.degrees_of_freedom());
  for (int i = 0; i < intervals; ++i) {
    const double chi2 = parity.contradiction({driving.next(), known_bias(robot)}, nullptr).chi2;
    for (std::size_t k = 0; k < p.size(); ++k) alarms[k] += chi2 > limit[k] ? 1 : 0;
  }
  for (std::size_t k = 0; k < p.size(); ++k) {
    fmt::print("  wanted {}: {} of {} = {:.4g}\n", p[k], alarms[k], intervals, alarms[k] / double(intervals));
    expect_share(alarms[k], intervals, p[k], 0.999, fmt::format("{}", p[k]));
  }
}

TEST(FalseAlarms, AreAsManyAsAskedForWithOneDegreeOfFreedom) {
  expect_false_alarms(quiet_differential(), kStraight, test::trials(10'000'000));
}

TEST(FalseAlarms, AreAsManyAsAskedForWithFourDegreesOfFreedom) {
  expect_false_alarms(mecanum_with_pods(), {0.05, 0.02, 0.03}, test::trials(1'000'000));
}

TEST(FalseAlarms, TheDetectorAlarmsWhereChiSquaredIsBeyondItsLimit) {
  const Robot robot = quiet_differential();
  SlipDetector detector(robot, {.probability = 0.05});
  CleanDriving driving(robot, kStraight, 2);
  const int intervals = test::trials(100'000);
  const double limit = chi_squared_limit(0.05, 1.0);
  int alarms = 0;
  for (int i = 0; i < intervals; ++i) {
    const SlipVerdict verdict = detector.step({driving.next(), known_bias(robot)});
    EXPECT_EQ(verdict.alarm, verdict.chi2 > limit);
    alarms += verdict.alarm ? 1 : 0;
  }
  expect_share(alarms, intervals, 0.05, 0.999, "alarms");
}

/// 100 s, of which a wheel may run ahead in one interval.
SlipReport report_of(const Robot& robot, std::uint64_t seed, double slip_m = 0.0) {
  CleanDriving driving(robot, kStraight, seed);
  const VelocityStream no_commands;
  SlipSearch search(robot, no_commands);
  for (int i = 0; i < 400; ++i) {
    Increment increment = driving.next();
    if (i == 200) increment.turned[0] += slip_m / (kPi * robot.chassis.wheels()[0].diameter_m);
    search.step(increment, false);
  }
  return search.finish(0.0);
}

/// Of recordings without slip alarms are as many as `by_chance` says, and kClearSlip at most have a clear
/// slip; one of seven sigmas is clear.
TEST(FalseAlarms, AreRarelyClearSlips) {
  for (Robot robot : {quiet_differential(), mecanum_with_pods()}) {
    robot.chassis.gyro->bias_sigma_rad_s = 0.0;
    const int recordings = test::trials(1000);
    double alarms = 0.0;
    double by_chance = 0.0;
    int with_clear = 0;
    int seen = 0;
    const double slip_m = 7.0 * report_of(robot, 1, 0.05).events.front().excess_sigma_m;
    for (int i = 0; i < recordings; ++i) {
      const SlipReport clean = report_of(robot, static_cast<std::uint64_t>(i));
      alarms += static_cast<double>(clean.counts.alarms);
      by_chance += clean.counts.by_chance / (1.0 + SlipOptions{}.persistent_share);
      with_clear += clear_slips(clean).empty() ? 0 : 1;
      seen += clear_slips(report_of(robot, static_cast<std::uint64_t>(i), slip_m)).empty() ? 0 : 1;
    }
    fmt::print("  {} alarms, {:.0f} by chance; {} of {} with a clear slip; {} seen\n", alarms, by_chance,
               with_clear, recordings, seen);
    EXPECT_NEAR(alarms, by_chance, normal_limit(1e-3) * std::sqrt(by_chance));
    EXPECT_LE(with_clear, kClearSlip * recordings + binomial_spread(kClearSlip, recordings, 0.999));
    EXPECT_GE(seen, 0.97 * recordings - binomial_spread(0.97, recordings, 0.999));
  }
}

std::vector<JudgedInterval> clean_driving(const Robot& robot, const Twist2& motion, int count,
                                          std::uint64_t seed) {
  CleanDriving driving(robot, motion, seed);
  std::vector<JudgedInterval> clean;
  for (int i = 0; i < count; ++i) clean.push_back({driving.next(), known_bias(robot)});
  return clean;
}

double normal_tail(double z) {
  return 0.5 * std::erfc(z / std::sqrt(2.0));
}

// The share of clean intervals outside a band is known exactly once the band is; only relearning is random.
TEST(FalseAlarms, LearnedBandsHoldOnAverageWhatStudentPromises) {
  const Robot robot = quiet_differential();
  const int repeats = test::trials(500);
  for (const double p : {0.05, 0.01}) {
    double sum = 0.0;
    double squares = 0.0;
    int empirical = 0;
    for (int i = 0; i < repeats; ++i) {
      const auto clean = clean_driving(robot, kStraight, 300, static_cast<std::uint64_t>(1000 + i));
      const Band band = learn_band(clean, robot, LearnOptions{.probability = p}).band;
      const Contradiction c = Parity(robot).contradiction(clean.front(), nullptr);
      const double sigma = c.excess_sigma_m[0] / 0.5;  // of δ
      const double rate = normal_tail(band.upper / sigma) + normal_tail(-band.lower / sigma);
      sum += rate;
      squares += rate * rate;
      empirical += band.empirical ? 1 : 0;
    }
    const double mean = sum / repeats;
    const double error = std::sqrt((squares / repeats - mean * mean) / repeats);
    fmt::print("  learned, wanted {}: {:.5f} ± {:.5f}, {} of {} not normal\n", p, mean, error, empirical,
               repeats);
    EXPECT_NEAR(mean, p, 3.3 * error);
  }
}

TEST(FalseAlarms, LearnedResidualsHoldOnAverageWhatHotellingPromises) {
  const Robot robot = mecanum_with_pods();
  const Twist2 motion{0.05, 0.02, 0.03};
  const int repeats = test::trials(200);
  constexpr int kTests = 500;
  constexpr double kP = 0.01;
  double sum = 0.0;
  double squares = 0.0;
  for (int i = 0; i < repeats; ++i) {
    const auto clean = clean_driving(robot, motion, 300, static_cast<std::uint64_t>(5000 + i));
    const ResidualModel model = learn_residuals(clean, robot, {.probability = kP}).model;
    int alarms = 0;
    for (const JudgedInterval& interval :
         clean_driving(robot, motion, kTests, static_cast<std::uint64_t>(9000 + i)))
      alarms += Parity(robot).contradiction(interval, &model).chi2 > model.limit ? 1 : 0;
    const double rate = alarms / double(kTests);
    sum += rate;
    squares += rate * rate;
  }
  const double mean = sum / repeats;
  const double error = std::sqrt((squares / repeats - mean * mean) / repeats);
  fmt::print("  learned, 4 degrees of freedom, wanted {}: {:.5f} ± {:.5f}\n", kP, mean, error);
  EXPECT_NEAR(mean, kP, 3.3 * error);
}

/// P(|N(s, 1)| > z) in at least one of m intervals.
double single_power(double s, int m, double z) {
  return 1.0 - std::pow(1.0 - normal_tail(z - s) - normal_tail(z + s), m);
}

/// One of two cumulative sums passes h within m scores N(s, 1), both from zero: integrated over a fine grid
/// of both sums. They are never above zero together for long, but the grid does not assume that.
class CusumChain {
 public:
  CusumChain(double limit, double allowance) : limit_(limit), allowance_(allowance) {}

  double power(double s, int m) const {
    std::vector<double> state(kCells * kCells, 0.0);
    state[0] = 1.0;
    double alarmed = 0.0;
    for (int i = 0; i < m; ++i) {
      alarmed += alarms(state, s);
      state = stepped(state, s);
      // What the grid lost at its edge comes back: those that did not alarm are still there.
      const double total = std::accumulate(state.begin(), state.end(), 0.0);
      if (total <= 0.0) break;
      for (double& p : state) p *= (1.0 - alarmed) / total;
    }
    return alarmed;
  }

 private:
  static constexpr std::size_t kCells = 100;
  static constexpr int kScores = 200;
  static constexpr double kReach = 6.5;  // sigmas

  double value(std::size_t cell) const { return limit_ * static_cast<double>(cell) / kCells; }
  /// Shares of a sum between two neighbouring grid points.
  template <typename F>
  void spread(double sum, F add) const {
    const double at = sum / limit_ * kCells;
    const auto cell = static_cast<std::size_t>(at);
    const double u = at - static_cast<double>(cell);
    add(std::min(cell, kCells - 1), 1.0 - u);
    if (u > 0.0) add(std::min(cell + 1, kCells - 1), u);
  }

  /// One sum or the other passes the limit next: never both.
  double alarms(const std::vector<double>& state, double s) const {
    double sum = 0.0;
    for (std::size_t a = 0; a < kCells; ++a)
      for (std::size_t b = 0; b < kCells; ++b)
        sum += state[a * kCells + b] * (normal_tail(limit_ + allowance_ - value(a) - s) +
                                        normal_tail(limit_ + allowance_ - value(b) + s));
    return sum;
  }

  std::vector<double> stepped(const std::vector<double>& state, double s) const {
    std::vector<double> after(state.size(), 0.0);
    for (std::size_t a = 0; a < kCells; ++a)
      for (std::size_t b = 0; b < kCells; ++b)
        if (const double p = state[a * kCells + b]; p > 1e-14) move(p, value(a), value(b), s, after);
    return after;
  }

  void move(double p, double up, double down, double s, std::vector<double>& after) const {
    for (int k = 0; k < kScores; ++k) {
      const double n = kReach * (2.0 * (k + 0.5) / kScores - 1.0);
      const double score = s + n;
      const double share = std::exp(-0.5 * n * n) / std::sqrt(2.0 * kPi) * 2.0 * kReach / kScores;
      const double u = std::max(0.0, up + score - allowance_);
      const double d = std::max(0.0, down - score - allowance_);
      if (u > limit_ || d > limit_) continue;
      spread(u, [&](std::size_t i, double x) {
        spread(d, [&](std::size_t j, double y) { after[i * kCells + j] += p * x * y * share; });
      });
    }
  }

  double limit_;
  double allowance_;
};

/// Mean intervals between alarms of a one-sided cumulative sum [Brook & Evans 1972].
double run_length(double limit, double allowance) {
  constexpr int kCells = 300;
  const double width = limit / (kCells - 0.5);
  Eigen::MatrixXd A = Eigen::MatrixXd::Identity(kCells, kCells);
  for (int i = 0; i < kCells; ++i) {
    for (int j = 0; j < kCells; ++j) {
      const double up = (j - i + 0.5) * width + allowance;
      const double low = (j - i - 0.5) * width + allowance;
      A(i, j) -= j == 0 ? 1.0 - normal_tail(up) : normal_tail(low) - normal_tail(up);
    }
  }
  return A.partialPivLu().solve(Eigen::VectorXd::Ones(kCells))[0];
}

TEST(Cusum, ItsLimitGivesTheRunLengthAskedFor) {
  for (const double intervals : {1e3, 1e4, 1e5})
    EXPECT_NEAR(run_length(cusum_limit(intervals), kCusumAllowance) / intervals, 1.0, 0.05) << intervals;
}

TEST(Power, OfOneIntervalAndOfCumulativeSumsIsThatOfTheModel) {
  const Robot robot = differential_with_constant_noise();
  const Parity parity(robot);
  constexpr double kP = 0.01;
  const double z = normal_limit(kP);
  const double limit = chi_squared_limit(kP, 1.0);
  const double h = cusum_limit(2.0 / (0.1 * kP));
  const CusumChain chain(h, kCusumAllowance);
  CleanDriving driving(robot, kStraight, 3);
  const double excess_m =
      parity.contradiction({driving.next(), known_bias(robot)}, nullptr).excess_sigma_m[1];
  const double revolutions = excess_m / (kPi * test::kSize.diameter_m);
  const int trials = test::trials(4000, 200);
  fmt::print("  s: detected by one interval / by cumulative sums, of bursts of 1, 2, 3, 4 intervals\n");
  for (int s = 1; s <= 8; ++s) {
    std::string line;
    for (int m = 1; m <= 4; ++m) {
      int single = 0;
      int summed = 0;
      for (int t = 0; t < trials; ++t) {
        bool alarm = false;
        bool beyond = false;
        std::array<Cusum, 2> sums;
        for (int i = 0; i < m; ++i) {
          Increment increment = driving.next();
          increment.turned[1] += s * revolutions;
          const Contradiction c = parity.contradiction({increment, known_bias(robot)}, nullptr);
          alarm = alarm || c.chi2 > limit;
          beyond = sums[0].step(c.score[1], kCusumAllowance) > h || beyond;
          beyond = sums[1].step(-c.score[1], kCusumAllowance) > h || beyond;
        }
        single += alarm ? 1 : 0;
        summed += beyond ? 1 : 0;
      }
      line += fmt::format("  {:.3f}/{:.3f}", single / double(trials), summed / double(trials));
      // 64 intervals of 99 %: widened so that all of them hold together with 99 %.
      const double level = 1.0 - 0.01 / 64.0;
      expect_share(single, trials, single_power(s, m, z), level, fmt::format("single s {} m {}", s, m));
      expect_share(summed, trials, chain.power(s, m), level, fmt::format("sums s {} m {}", s, m));
      if (s >= z + 2.4) {
        EXPECT_GE(single, 0.99 * trials - binomial_spread(0.01, trials, 0.999));
      }
    }
    fmt::print("  {}:{}\n", s, line);
  }
}

// Counting errors correlate by −1/2 from one interval to the next: as independent they are over-estimated in
// a sum.
TEST(Cusum, RoundedCountsDoNotRaiseFalseAlarms) {
  Robot robot = quiet_differential();
  for (Wheel& wheel : robot.chassis.wheels()) wheel.ticks_per_revolution = 200.0;
  const int intervals = test::trials(200'000);
  constexpr double kP = 0.01;
  SlipDetector detector(robot, {.probability = kP});
  Random random(4);
  std::array<double, 2> turned = {random.uniform(), random.uniform()};
  std::array<double, 2> before = {std::round(turned[0] * 200.0), std::round(turned[1] * 200.0)};
  int persistent = 0;
  bool was = false;
  for (int i = 0; i < intervals; ++i) {
    Increment increment = test::increment_of(robot.chassis, kStraight, kQuarter_s);
    increment.time_s = kQuarter_s * (i + 1);
    for (std::size_t w = 0; w < 2; ++w) {
      turned[w] += increment.turned[w] + random.normal(2.5e-4) / (kPi * 0.15);
      const double now = std::round(turned[w] * 200.0);
      increment.turned[w] = (now - before[w]) / 200.0;
      before[w] = now;
    }
    increment.gyro_rad += random.normal(3e-4 * std::sqrt(kQuarter_s));
    const SlipVerdict verdict = detector.step({increment, known_bias(robot)});
    persistent += verdict.persistent && !was ? 1 : 0;
    was = verdict.persistent;
  }
  fmt::print("  cumulative sums with coarse counts: {} alarms of {} allowed\n", persistent,
             intervals * kP * 0.1);
  EXPECT_LE(persistent, intervals * kP * 0.1);
}

}  // namespace
}  // namespace trundle::slip
