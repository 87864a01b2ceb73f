#include "trundle/recording/csv/detail/misreadings.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "trundle/geometry/angle.hpp"
#include "trundle/io/error.hpp"
#include "trundle/recording/csv/detail/streams.hpp"

namespace trundle::recording {
namespace {

constexpr std::size_t kFewestRows = 20;  // that a verdict may rest on

std::string place_of(const StreamSource& source) {
  return source.place.empty() ? source.file.string() : source.place;
}

// ---- Stamps ----

constexpr double kFastest_s = 1e-4;  // no log of a robot has more rows

double mean_step(const Table& table) {
  return (table.time_s.back() - table.time_s.front()) / static_cast<double>(table.time_s.size() - 1);
}

/// The unit in which a log looks like one that a person makes: stamps of this century since 1970, or else a
/// step next to that of usual sensors.
std::string likely_unit(double step, double stamp) {
  constexpr std::array<std::pair<const char*, double>, 4> kUnits = {
      {{"s", 1.0}, {"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}}};
  constexpr double kUsualStep_s = 0.05;  // 20 Hz: in the middle, by ratio, of 1 and 400 Hz
  constexpr double kCenturyStart_s = 1e9, kCenturyEnd_s = 4e9;  // 2001 to 2096
  for (const auto& [name, unit] : kUnits)
    if (stamp * unit > kCenturyStart_s && stamp * unit < kCenturyEnd_s) return name;
  const auto strangeness = [&](const auto& unit) {
    return std::abs(std::log(step * unit.second / kUsualStep_s));
  };
  return std::ranges::min_element(kUnits, {}, strangeness)->first;
}

}  // namespace

void check_stamps(const Table& table, const StreamSource& source, const RowRules& rules,
                  std::vector<Finding>& findings) {
  if (!source.time || table.time_s.size() < kFewestRows) return;
  const double mean_s = mean_step(table);  // of rows that come in bursts more than their median
  const double step_s = rules.repeated_stamps ? mean_s : median_step(table.time_s);
  const bool too_fast = !rules.repeated_stamps && step_s < kFastest_s && mean_s < kFastest_s;
  if (step_s <= rules.slowest_s && !too_fast) return;
  const TimeScale& scale = source.time_scale;
  const double in_file = std::pow(10.0, -scale.unit_exponent);
  const double stamp = table.time_s.front() - source.time_offset_s + static_cast<double>(scale.origin_s);
  const std::string unit = likely_unit(step_s * in_file, stamp * in_file);
  if (!source.place.empty())
    throw InputError(
        source.place,
        fmt::format("the stamps of {} step by {:.3g} s from row to row", source.file.string(), step_s),
        fmt::format("time_unit = \"{}\"", unit));
  findings.push_back({.code = FindingCode::time_unit,
                      .place = place_of(source),
                      .payload = payload::StampStep{step_s, unit}});
}

// ---- Counts ----

namespace {

/// How a column goes from row to row.
struct Gait {
  std::size_t steps = 0;   ///< that are not zero
  double reversals = 0.0;  ///< share of these that go against the one before
  double coarse = 0.0;     ///< way over steps of eight rows, as a share of that over single rows
  double step = 0.0;       ///< mean of those that are not zero
  double way = 0.0;        ///< sum of their sizes
  double net = 0.0;        ///< from the first row to the last, as a share of the way
  double low = 0.0, high = 0.0;
};

/// Steps of a counter that wraps or starts again are left out.
Gait gait_of(std::span<const double> column) {
  Gait gait;
  std::size_t rows = 0;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const double value : column) {
    if (std::isnan(value)) continue;
    ++rows;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  if (rows < kFewestRows) return gait;
  gait.low = low;
  gait.high = high;
  const double jump = 0.5 * (high - low);
  double way = 0.0, net = 0.0, before = 0.0, stretch = 0.0, coarse_way = 0.0, reversals = 0.0;
  // Rows: what trembles to and fro cancels over them, what counts on does not.
  constexpr std::size_t kCoarse = 8;
  std::size_t row = 0;
  double last = std::numeric_limits<double>::quiet_NaN();
  for (const double now : column) {
    if (std::isnan(now)) continue;
    const double step = now - std::exchange(last, now);
    if (std::isnan(step)) continue;  // the first
    ++row;
    if (step != 0.0 && std::abs(step) < jump) {
      ++gait.steps;
      reversals += step * before < 0.0 ? 1.0 : 0.0;
      before = step;
      way += std::abs(step);
      net += step;
      stretch += step;
    }
    if (row % kCoarse != 0 && row + 1 < rows) continue;
    coarse_way += std::abs(stretch);
    stretch = 0.0;
  }
  if (gait.steps == 0) return gait;
  const auto steps = static_cast<double>(gait.steps);
  gait.reversals = reversals / steps;
  gait.coarse = coarse_way / way;
  gait.step = way / steps;
  gait.way = way;
  gait.net = std::abs(net) / way;
  return gait;
}

// The share of reversals is then known within 0.07 (1σ), a fifth of what is between the two kinds below.
constexpr std::size_t kFewestSteps = 50;

// Over 55 recorded columns of three robots, taken both ways: counters reverse in at most 9 % of their steps,
// keep 98 % of their way when seen every eighth row, and range over 31 % of it; counts since the row before
// reverse in at least 46 %, keep at most 72 % and range over at most 13 %. The limits stand between.

/// Counts of a robot that drives: they tremble about its speed, not far from zero.
bool looks_like_increments(const Gait& gait) {
  constexpr double kTremble = 3.0;  // steps: more than an encoder that rests between two counts
  return gait.reversals > 0.25 && gait.coarse < 0.85 && gait.high - gait.low < 0.2 * gait.way &&
         std::max(std::abs(gait.low), std::abs(gait.high)) > kTremble * gait.step &&
         gait.low <= gait.high - gait.low && gait.high >= gait.low - gait.high;
}

bool looks_like_counter(const Gait& gait) {
  constexpr double kFar = 300.0;  // steps
  return gait.reversals < 0.1 && gait.coarse > 0.95 && gait.net > 0.3 &&
         std::max(std::abs(gait.low), std::abs(gait.high)) > kFar * gait.step;
}

/// The cells that were summed up.
std::vector<double> differences(const std::vector<double>& sums) {
  std::vector<double> cells;
  for (std::size_t row = 1; row < sums.size(); ++row) cells.push_back(sums[row] - sums[row - 1]);
  return cells;
}

/// Columns of which all, and at least one, look so.
struct Suspects {
  std::vector<std::string> names;
  double low = 0.0, high = 0.0;
  bool all = true;

  void add(const std::string& name, const Gait& gait, bool suspicious) {
    if (gait.steps < kFewestSteps) return;
    all = all && suspicious;
    low = names.empty() ? gait.low : std::min(low, gait.low);
    high = names.empty() ? gait.high : std::max(high, gait.high);
    names.push_back(name);
  }
  bool any() const { return all && !names.empty(); }
};

}  // namespace

void check_increments(const WheelStream& wheels, const StreamSource& source, std::vector<Finding>& findings) {
  Suspects suspects;
  for (const WheelSeries& series : wheels.series) {
    if (series.unit == WheelUnit::rate) continue;
    const Gait gait = source.increments ? gait_of(differences(series.value)) : gait_of(series.value);
    suspects.add(column_name(series), gait,
                 source.increments ? looks_like_counter(gait) : looks_like_increments(gait));
  }
  if (!suspects.any()) return;
  findings.push_back({.code = source.increments ? FindingCode::not_increments : FindingCode::increments,
                      .place = place_of(source),
                      .subjects = suspects.names,
                      .payload = payload::Range{suspects.low, suspects.high}});
}

// ---- Headings ----

void check_headings(std::span<const double> headings, const StreamSource& source,
                    std::vector<Finding>& findings) {
  constexpr double kWhole = 6.3;  // [rad] a turn, and what rounding may add
  constexpr double kShare = 0.1, kShareOfSteps = 0.01;
  std::size_t rows = 0, beyond = 0, half_turns = 0;
  double farthest = 0.0, before = std::numeric_limits<double>::quiet_NaN();
  for (const double heading : headings) {
    if (std::isnan(heading)) continue;
    ++rows;
    beyond += std::abs(heading) > kWhole ? 1 : 0;
    farthest = std::max(farthest, std::abs(heading));
    half_turns += std::abs(heading - std::exchange(before, heading)) > kPi ? 1 : 0;
  }
  // Radians either stay within a turn, or go on by less than half of one from row to row.
  if (rows < kFewestRows || static_cast<double>(beyond) <= kShare * static_cast<double>(rows) ||
      static_cast<double>(half_turns) <= std::max(2.0, kShareOfSteps * static_cast<double>(rows)))
    return;
  findings.push_back({.code = FindingCode::reference_unit,
                      .place = place_of(source),
                      .count = half_turns,
                      .payload = payload::Excess{.farthest = farthest, .limit = kWhole, .all = rows}});
}

// ---- Bearings ----

void check_bearings(const std::vector<Sighting>& sightings, const StreamSource& source,
                    std::vector<Finding>& findings) {
  constexpr double kWhole = 6.3;  // [rad] a turn, and what rounding may add
  constexpr double kShare = 0.1;
  if (sightings.size() < kFewestRows) return;
  std::size_t beyond = 0;
  double farthest = 0.0;
  for (const Sighting& sighting : sightings) {
    const double size = std::abs(sighting.bearing_rad);
    beyond += size > kWhole ? 1 : 0;
    farthest = std::max(farthest, size);
  }
  if (static_cast<double>(beyond) <= kShare * static_cast<double>(sightings.size())) return;
  findings.push_back(
      {.code = FindingCode::bearing_unit,
       .place = place_of(source),
       .count = beyond,
       .payload = payload::Excess{.farthest = farthest, .limit = kWhole, .all = sightings.size()}});
}

}  // namespace trundle::recording
