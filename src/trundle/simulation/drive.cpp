#include "trundle/simulation/drive.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "trundle/io/interruption.hpp"
#include "trundle/simulation/command.hpp"
#include "trundle/simulation/kinematics.hpp"
#include "trundle/simulation/steering.hpp"
#include "trundle/simulation/streams.hpp"

namespace trundle::simulation {
namespace {

/// Where twist or bookkeeping changes: samples, ends of segments, edges of slips.
std::vector<double> cut_times(const Command& command, const std::vector<SlipBurst>& slips, double rate_hz) {
  std::vector<double> cuts = command.corners();
  const double end = command.end_s();
  for (int k = 0; k / rate_hz <= end; ++k) cuts.push_back(k / rate_hz);
  for (const SlipBurst& slip : slips)
    for (const double t : {slip.span.start_s, slip.span.end_s()})
      if (t > 0.0 && t < end) cuts.push_back(snapped(t, rate_hz));
  std::ranges::sort(cuts);
  const auto same = [](double a, double b) { return b - a < kSameTime_s; };
  cuts.erase(std::unique(cuts.begin(), cuts.end(), same), cuts.end());
  return cuts;
}

bool overlaps(const TimeSpan& a, const TimeSpan& b) {
  return a.start_s < b.end_s() && b.start_s < a.end_s();
}

std::vector<SlipBurst> all_slips(const Scenario& scenario, double end_s) {
  constexpr int kTries = 1000;  // where there is no room for as many slips as wanted there are fewer
  std::vector<SlipBurst> slips = scenario.slips;
  const RandomSlips& wanted = scenario.random_slips;
  Random random = random_for(scenario.seed, RandomStream::slips);
  const std::size_t count = slips.size() + static_cast<std::size_t>(wanted.count);
  for (int i = 0; i < kTries && slips.size() < count; ++i) {
    SlipBurst slip;
    slip.wheel =
        static_cast<int>(random.below(static_cast<std::uint64_t>(scenario.truth.chassis.wheel_count)));
    slip.span.duration_s = random.uniform(wanted.shortest_s, wanted.longest_s);
    slip.span.start_s = random.uniform(0.0, std::max(0.0, end_s - slip.span.duration_s));
    slip.factor = random.uniform(wanted.least_factor, wanted.greatest_factor);
    if (std::ranges::none_of(slips, [&](const SlipBurst& s) { return overlaps(s.span, slip.span); }))
      slips.push_back(slip);
  }
  return slips;
}

/// Draws the errors of an interval and keeps the books of the slips.
class ErrorSource {
 public:
  ErrorSource(const Scenario& scenario, const Rows& rows, std::vector<SlipBurst> slips)
      : chassis_(scenario.truth.chassis),
        steering_(scenario.steering),
        rows_(rows),
        slips_(std::move(slips)),
        wheels_(random_for(scenario.seed, RandomStream::wheels)),
        lateral_(random_for(scenario.seed, RandomStream::lateral)) {
    for (const SlipBurst& slip : slips_) truths_.push_back({slip.wheel, slip.span});
  }

  RowErrors draw(const RowVector& travel, const TimeSpan& interval) {
    RowErrors errors{RowVector::Zero(rows_.measured), RowVector::Zero(rows_.count() - rows_.measured)};
    if (!travel.isZero(0.0)) {
      for (int i = 0; i < rows_.measured; ++i) errors.measured[i] = wheels_.normal(row_sigma(i, travel));
      const double mean_travel = mean_wheel_travel(travel);
      for (int i = rows_.measured; i < rows_.count(); ++i)
        errors.lateral[i - rows_.measured] = lateral_.normal(lateral_per_sqrt_m(i) * std::sqrt(mean_travel));
    }
    add_slips(travel, interval, errors);
    return errors;
  }

  const std::vector<SlipTruth>& slips() const { return truths_; }

 private:
  double row_sigma(int i, const RowVector& travel) const {
    if (rows_.row[static_cast<std::size_t>(i)].kind == RowKind::turn)
      return std::hypot(chassis_.noise.turn_per_sqrt_rad * std::sqrt(std::abs(travel[i])),
                        chassis_.noise.turn_per_sqrt_m * std::sqrt(std::abs(travel[0])));
    const double per_sqrt_m = chassis_.wheel_count > 0 ? wheel_noise(chassis_, static_cast<std::size_t>(i))
                                                       : chassis_.noise.wheel_per_sqrt_m;
    return per_sqrt_m * std::sqrt(std::abs(travel[i]));
  }

  double mean_wheel_travel(const RowVector& travel) const {
    return rows_.row[0].kind == RowKind::forward ? std::abs(travel[0]) : travel.cwiseAbs().mean();
  }

  double lateral_per_sqrt_m(int i) const {
    const bool skids = rows_.row[static_cast<std::size_t>(i)].kind == RowKind::skid_lateral;
    return skids ? chassis_.noise.skid_per_sqrt_m : chassis_.noise.lateral_per_sqrt_m;
  }

  void add_slips(const RowVector& travel, const TimeSpan& interval, RowErrors& errors) {
    for (std::size_t i = 0; i < slips_.size(); ++i) {
      const SlipBurst& slip = slips_[i];
      const double middle = interval.start_s + 0.5 * interval.duration_s;
      if (middle < slip.span.start_s || middle >= slip.span.end_s()) continue;
      const double excess =
          excess_of_factor(slip.factor, travel[slip.wheel]) + slip.excess_m_s * interval.duration_s;
      errors.measured[slip.wheel] += excess;
      truths_[i].excess_m += excess;
      truths_[i].ground_m += steering_ == Steering::truth ? travel[slip.wheel] : travel[slip.wheel] - excess;
    }
  }

  /// Wheel travel = factor · ground travel; what is given is the ground's travel when the truth drives the
  /// path, the wheel's when odometry does.
  double excess_of_factor(double factor, double travel) const {
    if (steering_ == Steering::truth) return (factor - 1.0) * travel;
    assert(factor > 0.0);
    return (1.0 - 1.0 / factor) * travel;
  }

  const Chassis& chassis_;
  Steering steering_;
  const Rows& rows_;
  std::vector<SlipBurst> slips_;
  std::vector<SlipTruth> truths_;
  Random wheels_;
  Random lateral_;
};

Moment moved(const Moment& before, double time_s, const Motion& motion, const Chassis& truth) {
  Moment after{time_s, before.body * exp(motion.twist), before.turned, {}};
  if (truth.wheel_count == 0) {
    const ForwardAndTurn read =
        read_as(truth.velocity, {motion.travel[0], motion.travel[1]}, time_s - before.time_s);
    after.turned[0] += read.forward_m;
    after.turned[1] += read.turn_rad;
    return after;
  }
  for (int i = 0; i < motion.travel.size(); ++i) {
    const auto w = static_cast<std::size_t>(i);
    after.turned[w] += motion.travel[i] / (kPi * truth.wheels()[w].diameter_m);
  }
  return after;
}

}  // namespace

Drive drive(const Scenario& scenario) {
  const Command command(scenario);
  const std::vector<SlipBurst> slips = all_slips(scenario, command.end_s());
  const std::vector<double> cuts = cut_times(command, slips, scenario.encoders.rate_hz);
  Kinematics kinematics(scenario);
  const bool steered = is_steered(scenario.truth.chassis);
  const SteeringPlan steering = steered ? plan_steering(scenario, kinematics, command, cuts) : SteeringPlan{};
  ErrorSource error_source(scenario, kinematics.rows(), slips);
  Drive result;
  result.moments.push_back({0.0, scenario.start, {}, {}});
  if (steered) result.moments.front().steering_rad = steering.at.front();
  for (std::size_t i = 1; i < cuts.size(); ++i) {
    check_interruption();
    const Moment& before = result.moments.back();
    const TimeSpan interval{before.time_s, cuts[i] - before.time_s};
    if (steered) kinematics.steer(steering.within[i - 1]);
    const Twist2 commanded = command.over(interval);
    const RowErrors errors =
        error_source.draw(kinematics.ideal_travel(commanded, interval.duration_s), interval);
    result.moments.push_back(moved(before, cuts[i], kinematics.move(commanded, errors, interval.duration_s),
                                   scenario.truth.chassis));
    if (!steered) continue;
    result.moments.back().steering_rad = steering.at[i];
    result.moments.back().steering_within_rad = steering.within[i - 1];
  }
  result.slips = error_source.slips();
  return result;
}

}  // namespace trundle::simulation
