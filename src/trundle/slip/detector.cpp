#include "trundle/slip/detector.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include <Eigen/Dense>
#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/statistics/distribution.hpp"

namespace trundle::slip {
namespace {

// Hysteresis: a slip goes on while its wheel's score stays beyond this with the same sign, and ends after so
// many intervals without.
constexpr double kHold = 1.5;
constexpr int kQuiet = 2;              // noise may hide a slip in one of them
constexpr double kAlternative = 0.01;  // least posterior probability of a wheel that counts as one
// Cumulative sums saturate this far beyond their limit, so that they come back soon after a slip.
constexpr double kSaturation = 2.0;
constexpr double kBiasAllowance = 2.0;  // sigmas

}  // namespace

SlipDetector::SlipDetector(const Robot& robot, const SlipOptions& options)
    : parity_(robot), options_(options) {
  if (options.method == SlipMethod::published && !suits_published_method(parity_))
    throw CannotAnswer(
        fmt::format("robot '{}': the published method is for two wheels that roll forward, with a gyro; use "
                    "the general one",
                    robot.name));
  const double dof = parity_.degrees_of_freedom();
  limit_ = options_.model ? options_.model->limit : chi_squared_limit(options_.probability, dof);
  int checked = 0;
  for (std::size_t i = 0; i < parity_.faults().size(); ++i) {
    checked_[i] = parity_.is_checked(parity_.faults()[i]);
    checked += checked_[i] ? 1 : 0;
  }
  const double sums = 2.0 * std::max(1, checked);
  persistent_limit_ = cusum_limit(sums / (options_.probability * options_.persistent_share));
  if (options_.model) persistent_limit_ = std::max(persistent_limit_, options_.model->persistent_limit);
  forget_sums();
}

void SlipDetector::forget_sums() {
  for (auto& both : sums())
    for (Sum& sum : both) {
      sum = Sum{};
      sum.e = ParityVector::Zero(parity_.degrees_of_freedom());
    }
}

/// What was before is no guide.
void SlipDetector::forget() {
  forget_sums();
  recent_.forget();
  before_ = {};
}

SlipStatus SlipDetector::status_of(const Increment& interval) const {
  if (parity_.uses_gyro() && !interval.has_gyro) return SlipStatus::no_gyro;
  if (parity_.wheels() == 0 || !any_turns(interval)) return SlipStatus::parked;
  if (options_.method == SlipMethod::general) {
    const bool other_length = options_.model && std::abs(interval.duration_s - options_.model->interval_s) >
                                                    0.5 * options_.model->interval_s;
    return other_length ? SlipStatus::not_learned : SlipStatus::judged;
  }
  const auto travel = [&](std::size_t i) {
    return kPi * parity_.chassis().wheels()[i].diameter_m * interval.turned[i];
  };
  if (!is_nearly_straight(travel(0), travel(1))) return SlipStatus::not_applicable;
  const double speed = 0.5 * (travel(0) + travel(1)) / interval.duration_s;
  if (options_.band && !options_.band->holds_for(interval.duration_s, speed)) return SlipStatus::not_learned;
  return SlipStatus::judged;
}

void SlipDetector::state_statistic(const Contradiction& c, SlipVerdict& verdict) const {
  verdict.chi2 = c.chi2;
  verdict.statistic = by_band() ? delta(c) : c.chi2;
  verdict.alarm = by_band() ? !options_.band->contains(delta(c)) : c.chi2 > limit_;
}

/// Feeds the cumulative sums; true where one of them is beyond its limit.
bool SlipDetector::accumulate(const Contradiction& c, const Increment& interval) {
  bool beyond = false;
  for (std::size_t i = 0; i < parity_.faults().size(); ++i) {
    if (!checked_[i]) continue;
    for (std::size_t side = 0; side < 2; ++side) {
      Sum& sum = sums_[i][side];
      const double score = side == 0 ? c.score[i] : -c.score[i];
      if (sum.cusum.sum == 0.0) {
        sum.intervals = 0;
        sum.e.setZero();
        sum.travel.fill(0.0);
        sum.chi2 = 0.0;
        if (parity_.is_steered()) sum.shares = {};
        sum.start_s = interval.time_s - interval.duration_s;
      }
      sum.cusum.step(score, kCusumAllowance + kBiasAllowance * c.drift[i]);
      sum.cusum.sum = std::min(sum.cusum.sum, persistent_limit_ + kSaturation);
      ++sum.intervals;
      sum.e += c.e;
      for (std::size_t j = 0; j < parity_.wheels(); ++j) sum.travel[j] += c.travel[j];
      if (parity_.is_steered()) add_shares(c, sum);
      beyond = beyond || sum.cusum.sum > persistent_limit_;
    }
  }
  return beyond;
}

void SlipDetector::add_shares(const Contradiction& c, Sum& sum) const {
  const Faults& faults = parity_.faults();
  sum.chi2 += c.chi2;
  for (std::size_t i = 0; i < faults.size(); ++i) {
    if (c.excess_sigma_m[i] == 0.0) continue;
    const double travel = c.travel[static_cast<std::size_t>(faults[i].wheel)] / c.excess_sigma_m[i];
    sum.shares[i].by_residual += travel * c.score[i];
    sum.shares[i].by_itself += travel * travel;
  }
}

SlipVerdict SlipDetector::step(const JudgedInterval& judged, CommandChange command) {
  const Increment& interval = judged.readings;
  if (command.changed) recent_.forget(command.slows);
  SlipVerdict verdict;
  verdict.limit = limit_;
  verdict.status = status_of(interval);
  if (verdict.status != SlipStatus::judged) {
    uneven_.turn(interval);
    end_event(verdict);
    forget();
    return verdict;
  }
  const Contradiction c = parity_.contradiction(judged, options_.model ? &*options_.model : nullptr);
  state_statistic(c, verdict);
  if (options_.method == SlipMethod::general) {
    if (parity_.degrees_of_freedom() == 1) uneven_.add(c, parity_);
    if (!verdict.alarm) verdict.persistent = accumulate(c, interval);
  }
  judge(c, interval, verdict);
  if (event_.lasts()) correct(c, judged.bias, verdict);
  if (verdict.slipping || may_have_begun(c))
    recent_.pass();
  else
    recent_.add(c, interval.duration_s, parity_.wheels());
  for (std::size_t i = 0; i < parity_.faults().size(); ++i) {
    before_[i] = {};
    if (!event_.lasts()) before_[i].add(c.excess_m[i], c, i);
  }
  return verdict;
}

SlipVerdict SlipDetector::finish() {
  SlipVerdict verdict;
  end_event(verdict);
  return verdict;
}

SlipVerdict SlipDetector::interrupt() {
  forget();
  uneven_.forget();
  return finish();
}

void SlipDetector::judge(const Contradiction& c, const Increment& interval, SlipVerdict& verdict) {
  if (!(verdict.alarm || verdict.persistent || (event_.lasts() && holds_on(c)))) {
    if (event_.lasts()) wait(c, verdict);
    return;
  }
  if (event_.lasts() && verdict.alarm && is_another(c)) end_event(verdict);
  if (event_.lasts())
    add_evidence(c, interval);
  else
    begin(c, interval, !verdict.alarm);
  event_.set_radius_probability(uneven_.probability(parity_.wheels()));
  event_.lasts_until(interval.time_s);
  verdict.slipping = true;
}

/// A quiet interval, the first of which the slip may have ended in.
void SlipDetector::wait(const Contradiction& c, SlipVerdict& verdict) {
  const int quiet = event_.be_quiet();
  if (quiet == 1) event_.add(excesses_of(c, parity_.faults().size()));
  if (quiet < (options_.method == SlipMethod::published ? 1 : kQuiet)) return;
  end_event(verdict);
  forget_sums();
}

void SlipDetector::begin(const Contradiction& c, const Increment& interval, bool persistent) {
  if (!persistent) {
    event_.begin(interval.time_s - interval.duration_s, parity_.faults(), candidates(c),
                 prior(c, interval.duration_s));
    event_.add(before_);
    return add_evidence(c, interval);
  }
  const Sum* largest = &sums_[0][0];
  for (const auto& both : sums())
    for (const Sum& sum : both)
      if (sum.cusum.sum > largest->cusum.sum) largest = &sum;
  event_.begin(largest->start_s, parity_.faults(), checked_, prior(c, interval.duration_s));
  event_.add(SlipEvidence::Stretch{c, largest->intervals, largest->e, largest->travel, largest->chi2,
                                   parity_.is_steered() ? &largest->shares : nullptr});
}

int SlipDetector::wheel_by_rule(const Contradiction& c) const {
  return spinning_wheel(delta(c) > (by_band() ? options_.band->upper : 0.0), c, parity_.rows());
}

/// What may be at fault: by source 2's rule one wheel.
std::array<bool, kMaxFaults> SlipDetector::candidates(const Contradiction& c) const {
  if (options_.method == SlipMethod::general) return checked_;
  std::array<bool, kMaxFaults> only{};
  only[static_cast<std::size_t>(wheel_by_rule(c))] = true;
  return only;
}

SlipPrior SlipDetector::prior(const Contradiction& c, double duration_s) const {
  const double push = recent_.push_probability(c, duration_s, parity_.wheels());
  const double odds = options_.spin_odds;
  return {.spin_probability = (push * odds + 1.0 - push) / (1.0 + odds)};
}

/// A slip is that of one wheel to one side. Another begins where none that it may have been explains the
/// interval, and one wheel does.
bool SlipDetector::is_another(const Contradiction& c) const {
  const SlipEvidence::Attribution who = event_.attribute();
  if (options_.method == SlipMethod::published) return who.wheel != wheel_by_rule(c);
  bool explained = false;
  for (std::size_t i = 0; i < parity_.faults().size(); ++i) {
    if (c.chi2 - c.score[i] * c.score[i] > limit_) continue;
    const bool same_side = c.score[i] * event_.excess_m(i) > 0.0;
    if (same_side && who.probability[i] > kAlternative) return false;
    explained = true;
  }
  return explained;
}

void SlipDetector::add_evidence(const Contradiction& c, const Increment& interval) {
  SlipEvidence::Interval judged{c, parity_.degrees_of_freedom() - 1, parity_.is_stuck(c)};
  if (options_.method == SlipMethod::general && parity_.degrees_of_freedom() == 1 && recent_.known())
    judged.motion = recent_.misfit(parity_.faults(), c, interval.duration_s, parity_.wheels());
  event_.add(judged);
}

/// A slip that begins within an interval may not alarm in it: it is no guide to how the wheels roll.
bool SlipDetector::may_have_begun(const Contradiction& c) const {
  const std::span<const double> scores(c.score.data(), parity_.faults().size());
  return std::ranges::any_of(scores, [](double score) { return std::abs(score) > kHold; });
}

/// The wheel that slips has not come back yet.
bool SlipDetector::holds_on(const Contradiction& c) const {
  if (options_.method == SlipMethod::published) return false;
  const std::size_t likeliest = event_.attribute().likeliest;
  return c.score[likeliest] * std::copysign(1.0, event_.excess_m(likeliest)) > kHold;
}

void SlipDetector::correct(const Contradiction& c, const GyroBias& bias, SlipVerdict& verdict) const {
  const SlipEvidence::Attribution who = event_.attribute();
  verdict.wheel = who.certain ? who.wheel : kAmbiguous;
  if (options_.method == SlipMethod::general)
    verdict.correction = mixture_of(event_, c, verdict.slipping);
  else if (verdict.slipping)
    verdict.correction = rebuilt(who.wheel, c, parity_.rows(), bias);
}

void SlipDetector::end_event(SlipVerdict& verdict) {
  if (event_.lasts()) verdict.ended_count = event_.tell(verdict.ended);
  event_.end();
}

}  // namespace trundle::slip
