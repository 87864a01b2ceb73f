#include "trundle/slip/find_slip.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/statistics/distribution.hpp"
#include "trundle/statistics/magnitude.hpp"

namespace trundle::slip {
namespace {

// Commands that differ less are the same.
constexpr double kSameCommand = 0.01;  // [m/s, rad/s]

void count(const SlipVerdict& verdict, SlipCounts& counts) {
  ++counts.intervals;
  switch (verdict.status) {
    case SlipStatus::judged:
      ++counts.judged;
      break;
    case SlipStatus::parked:
      ++counts.parked;
      break;
    case SlipStatus::no_gyro:
      ++counts.no_gyro;
      break;
    case SlipStatus::not_applicable:
      ++counts.not_applicable;
      break;
    case SlipStatus::not_learned:
      ++counts.not_learned;
      break;
  }
  counts.alarms += verdict.alarm ? 1 : 0;
  counts.slipping += verdict.slipping ? 1 : 0;
}

void append_events(const SlipVerdict& verdict, std::vector<SlipEvent>& events) {
  events.insert(events.end(), verdict.ended.begin(),
                verdict.ended.begin() + static_cast<std::ptrdiff_t>(verdict.ended_count));
}

Odometer::Options learning_bias(const Robot& robot) {
  Odometer::Options options;
  options.learn_gyro_bias = robot.chassis.gyro.has_value();
  return options;
}

bool spans_gap(const AlignedReadings& readings, std::size_t i) {
  return i < readings.bridged.size() && readings.bridged[i];
}

void report_unjudged(const SlipReport& report, double start_s, std::vector<Finding>& findings) {
  const auto note = [&](std::size_t number, FindingCode code) {
    if (number > 0) findings.push_back({Severity::note, code, fmt::format("{:.3f} s", start_s), number});
  };
  const SlipCounts& counts = report.counts;
  note(counts.no_gyro, FindingCode::slip_without_gyro);
  note(counts.not_applicable, FindingCode::slip_in_a_curve);
  note(counts.not_learned, FindingCode::slip_unlike_learned);
}

void require_judged(const SlipReport& report) {
  const SlipCounts& counts = report.counts;
  if (counts.judged > 0 || counts.intervals == counts.parked) return;
  throw CannotAnswer(fmt::format(
      "none of {} moving intervals can be judged: {} without gyro, {} not nearly straight, {} of another "
      "length or "
      "speed than learned; --method general judges any motion, --learn needs driving like this one",
      counts.intervals - counts.parked, counts.no_gyro, counts.not_applicable, counts.not_learned));
}

}  // namespace

CommandChange CommandChanges::until(double time_s) {
  CommandChange change;
  for (; next_ < commands_.time_s.size() && commands_.time_s[next_] <= time_s; ++next_) {
    if (next_ == 0) continue;
    const auto differs = [&](const std::vector<double>& v) {
      return !(std::abs(v[next_] - v[next_ - 1]) < kSameCommand);
    };
    if (!differs(commands_.forward_m_s) && !differs(commands_.yaw_rate_rad_s)) continue;
    const auto speed = [&](std::size_t i) { return std::abs(commands_.forward_m_s[i]); };
    change = {true, speed(next_) < speed(next_ - 1)};
  }
  return change;
}

SlipSearch::SlipSearch(const Robot& robot, const VelocityStream& commands, const SlipOptions& options)
    : odometer_(robot, {.odometry = learning_bias(robot), .slip = options}),
      changes_(commands),
      options_(options) {}

void SlipSearch::step(const Increment& increment, bool bridged) {
  const std::size_t end = ++increments_;
  const CommandChange changed = changes_.until(increment.time_s);
  if (bridged) {
    append_events(odometer_.step_across_gap(increment), report_.events);
    interval_begin_ = end;
    return;
  }
  const std::optional<SlipVerdict> verdict = odometer_.step(increment, changed);
  if (!verdict) return;
  count(*verdict, report_.counts);
  report_.intervals.push_back({increment.time_s, verdict->status, verdict->statistic, verdict->slipping});
  append_events(*verdict, report_.events);
  correct_until(end, verdict->correction);
}

void SlipSearch::correct_until(std::size_t end, const SlipCorrection& correction) {
  if (!correction.none() && interval_begin_ < end)
    report_.corrections.push_back({interval_begin_, end, correction});
  interval_begin_ = end;
}

SlipReport SlipSearch::finish(double start_s) {
  correct_until(increments_, odometer_.applied());
  append_events(odometer_.finish(), report_.events);
  report_.chi2_limit = odometer_.detector().limit();
  if (odometer_.detector().by_band()) report_.band = options_.band;
  report_.end = odometer_.odometer().pose();
  const Parity& parity = odometer_.detector().parity();
  // With one degree of freedom all faults look alike.
  const std::size_t faults = parity.degrees_of_freedom() == 1 ? 1 : parity.faults().size();
  report_.trials = static_cast<double>(report_.counts.judged * faults);
  const double persistent = options_.method == SlipMethod::general ? options_.persistent_share : 0.0;
  report_.counts.by_chance =
      (1.0 + persistent) * options_.probability * static_cast<double>(report_.counts.judged);
  require_judged(report_);
  report_unjudged(report_, start_s, report_.findings);
  return std::move(report_);
}

SlipReport find_slip(const AlignedReadings& readings, const VelocityStream& commands, const Robot& robot,
                     const SlipOptions& options) {
  SlipSearch search(robot, commands, options);
  for (std::size_t i = 0; i < readings.increments.size(); ++i)
    search.step(readings.increments[i], spans_gap(readings, i));
  return search.finish(readings.start_s);
}

AlignedReadings corrected(AlignedReadings readings, const SlipReport& report, const Robot& robot) {
  for (const CorrectedSpan& span : report.corrections)
    for (std::size_t i = span.begin; i < span.end; ++i)
      readings.increments.set(i, corrected(readings.increments[i], span.correction, robot.chassis));
  return readings;
}

std::vector<JudgedInterval> clean_intervals(const AlignedReadings& readings, const Robot& robot,
                                            double interval_s) {
  IncrementMerger merger(robot.chassis, interval_s);
  Odometer odometer(robot, learning_bias(robot));
  std::vector<JudgedInterval> clean;
  for (std::size_t i = 0; i < readings.increments.size(); ++i) {
    if (spans_gap(readings, i)) {
      odometer.step_across_gap(readings.increments[i]);
      merger.reset();
      continue;
    }
    odometer.step(readings.increments[i]);
    if (const auto interval = merger.add(readings.increments[i]))
      clean.push_back({*interval, odometer.gyro_bias(), merger.turn_rate_change(), merger.contacts()});
  }
  return clean;
}

std::string name_of(SlipKind kind) {
  switch (kind) {
    case SlipKind::spin:
      return "spin";
    case SlipKind::skid:
      return "skid";
    case SlipKind::stuck:
      return "stuck";
    case SlipKind::sideways:
      return "sideways";
    case SlipKind::unknown:
      break;
  }
  return "unknown";
}

std::string name_of(SlipStatus status) {
  constexpr std::array kNames = {"judged", "parked", "no_gyro", "not_applicable", "not_learned"};
  return kNames[static_cast<std::size_t>(status)];
}

std::string wheel_of(const SlipEvent& event, const Robot& robot) {
  return event.wheel == kAmbiguous ? "ambiguous" : robot.wheel_names[static_cast<std::size_t>(event.wheel)];
}

LostTravel lost_travel(std::span<const SlipEvent> events) {
  LostTravel lost;
  for (const SlipEvent& event : events) {
    lost.m += magnitude(event.excess_m, event.excess_sigma_m);
    lost.sigma_m = std::hypot(lost.sigma_m, event.excess_sigma_m);
  }
  return lost;
}

std::vector<double> shares_by_chance(const SlipReport& report) {
  const std::vector<SlipEvent>& events = report.events;
  std::vector<double> share(events.size());
  std::ranges::transform(events, share.begin(), [](const SlipEvent& event) {
    const double sigmas = event.excess_m == 0.0 ? 0.0 : event.excess_m / event.excess_sigma_m;
    return chi_squared_tail(sigmas * sigmas, 1.0);
  });
  std::vector<std::size_t> least_clear_first(events.size());
  std::iota(least_clear_first.begin(), least_clear_first.end(), std::size_t{0});
  std::ranges::sort(least_clear_first, std::greater{}, [&](std::size_t i) { return share[i]; });
  double least = 1.0;
  double as_clear = static_cast<double>(events.size());
  for (const std::size_t i : least_clear_first) {
    least = std::min(least, report.trials * share[i] / as_clear--);
    share[i] = least;
  }
  return share;
}

std::vector<SlipEvent> clear_slips(const SlipReport& report) {
  const std::vector<double> share = shares_by_chance(report);
  std::vector<SlipEvent> clear;
  for (std::size_t i = 0; i < share.size(); ++i)
    if (is_clear(share[i])) clear.push_back(report.events[i]);
  return clear;
}

std::string to_csv(const SlipReport& report, const Robot& robot) {
  std::string text = "start_s,end_s,wheel,kind,excess_m,confidence,excess_sigma_m,by_chance\n";
  const std::vector<double> by_chance = shares_by_chance(report);
  for (std::size_t i = 0; i < report.events.size(); ++i) {
    const SlipEvent& e = report.events[i];
    text += fmt::format("{:.6f},{:.6f},{},{},{:.6f},{:.4f},{:.6f},{:.6g}\n", e.start_s, e.end_s,
                        wheel_of(e, robot), name_of(e.kind), e.excess_m, e.confidence, e.excess_sigma_m,
                        by_chance[i]);
  }
  return text;
}

}  // namespace trundle::slip
