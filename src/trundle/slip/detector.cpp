#include "trundle/slip/detector.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include <Eigen/Dense>
#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/statistics/distribution.hpp"

namespace trundle {
namespace {

// Hysteresis: a slip goes on while its wheel's score stays beyond this with the same sign, and ends after so
// many intervals without.
constexpr double kHold = 1.5;
constexpr int kQuiet = 2;
// A slipping wheel's reading is doubted by this many times its excess: it pulls the estimate by a percent.
constexpr double kDoubt = 10.0;
constexpr double kWorthDoubting = 0.01;  // posterior probability
// Cumulative sums saturate this far beyond their limit, so that they come back soon after a slip.
constexpr double kSaturation = 2.0;
constexpr double kStraight = 0.2;
constexpr double kStillGyro = 4.0;      // sigmas
constexpr double kBiasAllowance = 2.0;  // sigmas

double squared(double x) {
  return x * x;
}

/// The variance added to a reading with such an excess. A slip that ends within an interval hardly shows in
/// it: there the variance is that which makes the excess likeliest, none where it may be noise.
double doubt(double excess, double sigma, bool slipping) {
  if (slipping) return squared(kDoubt * std::max(std::abs(excess), sigma));
  return std::max(0.0, squared(excess) - squared(sigma));
}

/// Two wheels that roll forward on either side, with a gyro.
bool suits_published_method(const Parity& parity) {
  if (parity.wheels() != 2 || !parity.uses_gyro()) return false;
  const RowMatrix& H = parity.rows().H;
  const auto forward = [&](int i) { return std::abs(H(i, 0) - 1.0) < 1e-9 && std::abs(H(i, 1)) < 1e-9; };
  return forward(0) && forward(1) && H(0, 2) != H(1, 2);
}

}  // namespace

Increment corrected(const Increment& increment, const SlipCorrection& correction, const Chassis& chassis) {
  Increment result = increment;
  const auto wheels = chassis.wheels();
  for (std::size_t i = 0; i < wheels.size(); ++i) result.slip_variance[i] += correction.variance[i];
  if (correction.rebuilt_wheel < 0) return result;
  // d' = other + B tan g, clamped so that it never turns against the motion: docs/slip.md, eq. 5.
  const auto slips = static_cast<std::size_t>(correction.rebuilt_wheel);
  const auto rolls = static_cast<std::size_t>(correction.other_wheel);
  const double g = (increment.gyro_rad - correction.bias_rad_s * increment.duration_s) * chassis.gyro->scale;
  const double other = kPi * wheels[rolls].diameter_m * increment.turned[rolls];
  const double travel = other + correction.track_m * std::tan(g);
  result.turned[slips] = travel * other < 0.0 ? 0.0 : travel / (kPi * wheels[slips].diameter_m);
  return result;
}

SlipDetector::SlipDetector(const Robot& robot, const SlipOptions& options)
    : parity_(robot), options_(options) {
  if (options.method == SlipMethod::published && !suits_published_method(parity_))
    throw CannotAnswer(
        fmt::format("robot '{}': the published method is for two wheels that roll forward, with a gyro; use "
                    "the general one",
                    robot.name));
  const double dof = parity_.degrees_of_freedom();
  limit_ = options_.model ? options_.model->limit : chi_squared_limit(options_.probability, dof);
  const Observability seen = observability(parity_.rows());
  int checked = 0;
  for (std::size_t i = 0; i < parity_.wheels(); ++i) {
    checked_[i] = std::ranges::find(seen.undetectable, static_cast<int>(i)) == seen.undetectable.end();
    checked += checked_[i] ? 1 : 0;
  }
  const double sums = 2.0 * std::max(1, checked);
  persistent_limit_ = cusum_limit(sums / (options_.probability * options_.persistent_share));
  if (options_.model) persistent_limit_ = std::max(persistent_limit_, options_.model->persistent_limit);
  forget_sums();
}

void SlipDetector::forget_sums() {
  for (auto& both : sums_)
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
  const double sum = travel(0) + travel(1);
  if (!(std::abs(travel(1) - travel(0)) < kStraight * std::abs(sum))) return SlipStatus::not_applicable;
  if (options_.band && !options_.band->holds_for(interval.duration_s, 0.5 * sum / interval.duration_s))
    return SlipStatus::not_learned;
  return SlipStatus::judged;
}

double SlipDetector::delta(const Contradiction& c) const {
  const RowMatrix& H = parity_.rows().H;
  return (c.travel[1] - c.travel[0]) / (H(1, 2) - H(0, 2)) - c.gyro_rad;
}

void SlipDetector::state_statistic(const Contradiction& c, SlipVerdict& verdict) const {
  verdict.chi2 = c.chi2;
  verdict.statistic = by_band() ? delta(c) : c.chi2;
  verdict.alarm = by_band() ? !options_.band->contains(delta(c)) : c.chi2 > limit_;
}

/// Feeds the cumulative sums; true where one of them is beyond its limit.
bool SlipDetector::accumulate(const Contradiction& c, const Increment& interval) {
  bool beyond = false;
  for (std::size_t i = 0; i < parity_.wheels(); ++i) {
    if (!checked_[i]) continue;
    for (std::size_t side = 0; side < 2; ++side) {
      Sum& sum = sums_[i][side];
      const double score = side == 0 ? c.score[i] : -c.score[i];
      if (sum.cusum.sum == 0.0) {
        sum.intervals = 0;
        sum.e.setZero();
        sum.travel.fill(0.0);
        sum.start_s = interval.time_s - interval.duration_s;
      }
      sum.cusum.step(score, kCusumAllowance + kBiasAllowance * c.drift[i]);
      sum.cusum.sum = std::min(sum.cusum.sum, persistent_limit_ + kSaturation);
      ++sum.intervals;
      sum.e += c.e;
      for (std::size_t j = 0; j < parity_.wheels(); ++j) sum.travel[j] += c.travel[j];
      beyond = beyond || sum.cusum.sum > persistent_limit_;
    }
  }
  return beyond;
}

SlipVerdict SlipDetector::step(const JudgedInterval& judged, bool command_changed) {
  const Increment& interval = judged.readings;
  if (command_changed) recent_.forget();
  SlipVerdict verdict;
  verdict.limit = limit_;
  verdict.status = status_of(interval);
  if (verdict.status != SlipStatus::judged) {
    end_event(verdict);
    forget();
    return verdict;
  }
  const Contradiction c = parity_.contradiction(judged, options_.model ? &*options_.model : nullptr);
  state_statistic(c, verdict);
  if (options_.method == SlipMethod::general && !verdict.alarm) verdict.persistent = accumulate(c, interval);
  judge(c, interval, verdict);
  if (event_.lasts()) correct(c, judged.bias, verdict);
  if (event_.lasts() || may_have_begun(c))
    recent_.pass();
  else
    recent_.add(c, interval.duration_s, parity_.wheels());
  before_ = event_.lasts() ? Excesses{} : excesses_of(c);
  return verdict;
}

SlipVerdict SlipDetector::finish() {
  SlipVerdict verdict;
  end_event(verdict);
  return verdict;
}

SlipVerdict SlipDetector::interrupt() {
  forget();
  return finish();
}

void SlipDetector::judge(const Contradiction& c, const Increment& interval, SlipVerdict& verdict) {
  if (!(verdict.alarm || verdict.persistent || (event_.lasts() && holds_on(c)))) {
    if (event_.lasts()) wait(c, verdict);
    return;
  }
  if (event_.lasts())
    add_evidence(c, interval);
  else
    begin(c, interval, !verdict.alarm);
  event_.lasts_until(interval.time_s);
  verdict.slipping = true;
}

/// A quiet interval, the first of which the slip may have ended in.
void SlipDetector::wait(const Contradiction& c, SlipVerdict& verdict) {
  const int quiet = event_.be_quiet();
  if (quiet == 1) event_.add(excesses_of(c));
  if (quiet < (options_.method == SlipMethod::published ? 1 : kQuiet)) return;
  end_event(verdict);
  forget_sums();
}

void SlipDetector::begin(const Contradiction& c, const Increment& interval, bool persistent) {
  if (!persistent) {
    event_.begin(interval.time_s - interval.duration_s, checked_);
    event_.add(before_);
    return add_evidence(c, interval);
  }
  const Sum* largest = &sums_[0][0];
  for (const auto& both : sums_)
    for (const Sum& sum : both)
      if (sum.cusum.sum > largest->cusum.sum) largest = &sum;
  event_.begin(largest->start_s, checked_);
  event_.add(SlipEvidence::Stretch{c, largest->intervals, largest->e, largest->travel});
}

void SlipDetector::add_evidence(const Contradiction& c, const Increment& interval) {
  SlipEvidence::Interval judged{c, parity_.degrees_of_freedom() - 1, is_stuck(c)};
  if (parity_.degrees_of_freedom() == 1 && recent_.decides(c, interval.duration_s, parity_.wheels())) {
    judged.misfit_by_motion.emplace();
    for (std::size_t i = 0; i < parity_.wheels(); ++i)
      (*judged.misfit_by_motion)[i] = recent_.misfit(i, c, interval.duration_s, parity_.wheels());
    judged.degrees_of_freedom += static_cast<int>(parity_.wheels());
  }
  event_.add(judged);
}

/// A slip that begins within an interval may not alarm in it: it is no guide to how the wheels roll.
bool SlipDetector::may_have_begun(const Contradiction& c) const {
  return std::ranges::any_of(c.score, [](double score) { return std::abs(score) > kHold; });
}

/// The wheel that slips has not come back yet.
bool SlipDetector::holds_on(const Contradiction& c) const {
  if (options_.method == SlipMethod::published) return false;
  const int likeliest = event_.attribute().likeliest;
  return c.score[static_cast<std::size_t>(likeliest)] * std::copysign(1.0, event_.excess_m(likeliest)) >
         kHold;
}

/// Wheels turn while those rows that stand still see every motion that the sensors see at all.
bool SlipDetector::is_stuck(const Contradiction& c) const {
  const Rows& rows = parity_.rows();
  RowMatrix still(0, 3);
  int turning = 0;
  const auto keep = [&](int row) {
    still.conservativeResize(still.rows() + 1, 3);
    still.row(still.rows() - 1) = rows.H.row(row);
  };
  for (std::size_t i = 0; i < parity_.wheels(); ++i) {
    if (c.travel[i] == 0.0)
      keep(static_cast<int>(i));
    else
      ++turning;
  }
  if (parity_.uses_gyro() && std::abs(c.gyro_rad) < kStillGyro * c.gyro_sigma_rad) keep(rows.measured - 1);
  if (turning < 2 || still.rows() == 0) return false;
  const auto rank = [](const RowMatrix& H) { return Eigen::ColPivHouseholderQR<RowMatrix>(H).rank(); };
  return rank(still) == rank(rows.H.topRows(rows.measured));
}

void SlipDetector::correct(const Contradiction& c, const GyroBias& bias, SlipVerdict& verdict) const {
  const SlipEvidence::Attribution who = event_.attribute();
  verdict.wheel = who.certain ? who.likeliest : kAmbiguous;
  if (options_.method == SlipMethod::published && who.certain) return rebuild(c, bias, verdict);
  const bool stuck = event_.is_stuck();
  if (!stuck && !who.certain && verdict.slipping && parity_.degrees_of_freedom() == 1)
    return share_doubt(c, who, verdict);
  for (std::size_t i = 0; i < parity_.wheels(); ++i) {
    const bool doubted = stuck         ? c.travel[i] != 0.0
                         : who.certain ? static_cast<int>(i) == who.likeliest
                                       : who.probability[i] > kWorthDoubting;
    const double excess = stuck ? c.travel[i] : c.excess_m[i];
    if (doubted) verdict.correction.variance[i] = doubt(excess, c.excess_sigma_m[i], verdict.slipping);
  }
}

/// docs/slip.md, eq. 16.
void SlipDetector::share_doubt(const Contradiction& c, const SlipEvidence::Attribution& who,
                               SlipVerdict& verdict) const {
  for (std::size_t i = 0; i < parity_.wheels(); ++i) {
    const double now = c.excess_m[i], up_to_now = event_.excess_m(static_cast<int>(i));
    verdict.correction.variance[i] =
        who.probability[i] * std::max(now * (2.0 * up_to_now - now), squared(c.excess_sigma_m[i]));
  }
}

void SlipDetector::rebuild(const Contradiction& c, const GyroBias& bias, SlipVerdict& verdict) const {
  SlipCorrection& correction = verdict.correction;
  correction.rebuilt_wheel = verdict.wheel;
  correction.other_wheel = 1 - verdict.wheel;
  const RowMatrix& H = parity_.rows().H;
  correction.track_m = H(correction.rebuilt_wheel, 2) - H(correction.other_wheel, 2);
  correction.bias_rad_s = bias.rad_s;
  correction.variance[static_cast<std::size_t>(verdict.wheel)] =
      squared(c.excess_sigma_m[static_cast<std::size_t>(verdict.wheel)]);
}

void SlipDetector::end_event(SlipVerdict& verdict) {
  if (event_.lasts()) verdict.ended_count = event_.tell(verdict.ended);
  event_.end();
}

}  // namespace trundle
