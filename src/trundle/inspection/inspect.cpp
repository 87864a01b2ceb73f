#include "trundle/inspection/inspect.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string_view>

#include "trundle/chassis/rows.hpp"
#include "trundle/chassis/without_wheel.hpp"
#include "trundle/inspection/detail/gyro_checks.hpp"
#include "trundle/recording/csv/detail/table.hpp"

namespace trundle::inspection {
namespace {

/// The robot that these columns are those of, as far as they tell: wheels that turn once in one unit.
Robot robot_of_columns(std::span<const WheelSeries> columns) {
  constexpr double kAnyDiameter_m = 1e9;  // no speed is expected of such a wheel
  Robot robot;
  for (const WheelSeries& series : columns) {
    robot.wheel_names.push_back(series.wheel);
    robot.chassis.add({.diameter_m = kAnyDiameter_m, .ticks_per_revolution = 1.0});
  }
  return robot;
}

std::size_t breaks_among(const std::vector<Finding>& problems) {
  std::size_t breaks = 0;
  for (const Finding& problem : problems)
    if (problem.code != FindingCode::wrap) breaks += problem.count;
  return breaks;
}

/// The bits of a counter whose values fill their range and that is seen to cross its end; 0 when none fit.
int guessed_bits(const Recording& recording, const WheelSeries& series) {
  if (series.unit != WheelUnit::ticks) return 0;
  Robot robot = robot_of_columns({&series, 1});
  const auto breaks_with = [&](int bits) {
    robot.chassis.wheels().front().tick_bits = bits;
    return breaks_among(align(recording, robot).findings);
  };
  const std::size_t breaks = breaks_with(0);
  if (breaks == 0) return 0;
  const auto [low, high] = std::ranges::minmax_element(series.value);
  for (const int bits : {8, 16, 32}) {
    const double range = std::ldexp(1.0, bits);
    const bool fits = (*low >= 0.0 && *high < range) || (*low >= -range / 2.0 && *high < range / 2.0);
    if (fits && breaks_with(bits) < breaks) return bits;
  }
  return 0;
}

/// The bits of a counter that the robot file tells; 0: none.
int told_bits(const WheelSeries& series, const Robot& robot) {
  const auto named = std::ranges::find(robot.wheel_names, series.wheel);
  if (series.unit != WheelUnit::ticks || named == robot.wheel_names.end()) return 0;
  return robot.chassis.wheels()[static_cast<std::size_t>(named - robot.wheel_names.begin())].tick_bits;
}

/// A stretch of rows over which a wheel reads the same.
struct Standstill {
  std::size_t first = 0;
  std::size_t last = 0;
};

std::vector<Standstill> standstills_of(const std::vector<double>& value, const std::vector<double>& time_s,
                                       double shortest_s) {
  std::vector<Standstill> found;
  for (std::size_t first = 0; first < value.size();) {
    std::size_t last = first;
    while (last + 1 < value.size() && (value[last + 1] == value[first] || std::isnan(value[last + 1])))
      ++last;
    if (time_s[last] - time_s[first] >= shortest_s) found.push_back({first, last});
    first = last + 1;
  }
  return found;
}

/// Length of the way between two rows, there and back counted twice.
double way(const std::vector<double>& value, std::size_t first, std::size_t last) {
  double sum = 0.0;
  for (std::size_t row = first + 1; row <= last; ++row) {
    const double step = std::abs(value[row] - value[row - 1]);
    if (!std::isnan(step)) sum += step;
  }
  return sum;
}

/// Times and the course of every wheel.
struct WheelCourses {
  std::vector<double> time_s;
  std::vector<std::string> wheel;
  std::vector<std::vector<double>> value;
};

constexpr double kShortestStandstill = 2.0;  // [s]

std::string place_at(const Recording& recording, double time_s) {
  const auto& stamps = recording.wheels.time_s;
  const auto row = std::ranges::lower_bound(stamps, time_s - 1e-9);
  return recording.wheels.origin.place_of(static_cast<std::size_t>(row - stamps.begin()));
}

/// Without knowing the robot: it stands still while every other wheel goes at least a twentieth of its whole
/// way.
void find_stuck(const Recording& recording, const WheelCourses& courses, std::vector<Finding>& problems) {
  constexpr double kShare = 0.05;  // less may be a robot that hardly moves, all wheels alike
  const std::size_t rows = courses.time_s.size();
  for (std::size_t w = 0; w < courses.wheel.size() && courses.wheel.size() > 1; ++w)
    for (const Standstill& still : standstills_of(courses.value[w], courses.time_s, kShortestStandstill)) {
      bool others_move = true;
      for (std::size_t other = 0; other < courses.wheel.size(); ++other) {
        const double whole = way(courses.value[other], 0, rows - 1);
        const double meanwhile = way(courses.value[other], still.first, still.last);
        if (other != w) others_move = others_move && whole > 0.0 && meanwhile >= kShare * whole;
      }
      if (!others_move) continue;
      problems.push_back(
          {.code = FindingCode::stuck_encoder,
           .place = place_at(recording, courses.time_s[still.first]),
           .subjects = {courses.wheel[w]},
           .payload = payload::Amount{courses.time_s[still.last] - courses.time_s[still.first]}});
    }
}

/// What the other sensors say that a wheel rolled over some intervals [m]; nothing where they cannot tell.
std::optional<double> expected_travel(const Robot& robot, std::size_t wheel,
                                      std::span<const Increment> increments) {
  const Chassis rest = without_wheel(robot.chassis, wheel);
  const bool with_gyro = rest.gyro && std::all_of(increments.begin(), increments.end(),
                                                  [](const Increment& i) { return i.has_gyro; });
  const Rows rows = rows_of(rest, with_gyro);
  if (rest.wheel_count == 0 || observability(rows).rank < 3) return std::nullopt;
  double travel = 0.0;
  for (const Increment& increment : increments) {
    const Twist2 twist = twist_of(rest, rows, without_wheel(increment, wheel));
    travel += rolling_row(robot.chassis.wheels()[wheel]).dot(twist.vector());
  }
  return travel;
}

/// The rows of the recording as courses of revolutions, one row more than there are increments.
WheelCourses courses_of(const AlignedReadings& readings, const Robot& robot) {
  WheelCourses courses{{readings.start_s}, robot.wheel_names, {}};
  courses.value.assign(robot.wheel_names.size(), {0.0});
  for (const Increment& increment : readings.increments) {
    courses.time_s.push_back(increment.time_s);
    for (std::size_t w = 0; w < courses.value.size(); ++w)
      courses.value[w].push_back(courses.value[w].back() + increment.turned[w]);
  }
  return courses;
}

void find_stuck(const Recording& recording, const Robot& robot, const AlignedReadings& readings,
                std::vector<Finding>& problems) {
  constexpr double kLeastTravel = 0.05;  // [m]
  const WheelCourses courses = courses_of(readings, robot);
  bool all_can_be_told = true;
  for (std::size_t w = 0; w < courses.wheel.size(); ++w)
    for (const Standstill& still : standstills_of(courses.value[w], courses.time_s, kShortestStandstill)) {
      const auto travel = expected_travel(
          robot, w, std::span(readings.increments).subspan(still.first, still.last - still.first));
      all_can_be_told = all_can_be_told && travel.has_value();
      if (!travel || std::abs(*travel) < kLeastTravel) continue;
      problems.push_back(
          {.code = FindingCode::stuck_encoder,
           .place = place_at(recording, courses.time_s[still.first] - robot.chassis.wheels_time_offset_s),
           .subjects = {courses.wheel[w]},
           .payload =
               payload::Standstill{.duration_s = courses.time_s[still.last] - courses.time_s[still.first],
                                   .expected_m = *travel}});
    }
  if (!all_can_be_told) find_stuck(recording, courses, problems);
}

/// Counts are whole: a column of metres or of speeds that is taken for them hardly turns its wheel.
void find_fractions(const Recording& recording, const Robot& robot, const AlignedReadings& readings,
                    std::vector<Finding>& problems) {
  const WheelCourses courses = courses_of(readings, robot);
  for (const WheelSeries& series : recording.wheels.series) {
    const auto named = std::ranges::find(robot.wheel_names, series.wheel);
    if (series.unit != WheelUnit::ticks || named == robot.wheel_names.end()) continue;
    const auto broken = [](double v) { return !std::isnan(v) && v != std::round(v); };
    const auto first = std::ranges::find_if(series.value, broken);
    if (2 * std::ranges::count_if(series.value, broken) < static_cast<std::ptrdiff_t>(series.value.size()) ||
        way(courses.value[static_cast<std::size_t>(named - robot.wheel_names.begin())], 0,
            courses.time_s.size() - 1) > 1.0)
      continue;
    problems.push_back(
        {.code = FindingCode::fractions,
         .place = recording.wheels.origin.place_of(static_cast<std::size_t>(first - series.value.begin())),
         .subjects = {series.wheel},
         .payload = payload::Amount{*first}});
  }
}

/// Counters that wrap where the robot file says otherwise look as if they started again.
void name_wraps(const Recording& recording, const Robot& robot, std::vector<Finding>& problems) {
  for (const WheelSeries& series : recording.wheels.series) {
    const auto named = std::ranges::find(robot.wheel_names, series.wheel);
    if (named == robot.wheel_names.end()) continue;
    const int bits = guessed_bits(recording, series);
    if (bits == 0) continue;
    const auto index = static_cast<std::size_t>(named - robot.wheel_names.begin());
    if (robot.chassis.wheels()[index].tick_bits == bits) continue;
    std::erase_if(problems, [&](const Finding& problem) {
      return (problem.code == FindingCode::counter_reset || problem.code == FindingCode::counter_jump) &&
             problem.subjects.front() == series.wheel;
    });
    problems.push_back({.code = FindingCode::tick_bits,
                        .place = recording.wheels.origin.file,
                        .subjects = {series.wheel},
                        .payload = payload::Amount{static_cast<double>(bits)}});
  }
}

/// What a gyro in another unit makes seem to be wrong.
bool is_of_gyro(FindingCode code) {
  using enum FindingCode;
  constexpr std::array kOfGyro = {gyro_missing, gyro_saturated,      gyro_disturbed, gyro_beyond_its_bias,
                                  gyro_sign,    gyro_against_wheels, gyro_unit};
  return std::ranges::find(kOfGyro, code) != kOfGyro.end();
}

}  // namespace

bool is_misreading(const Finding& finding) {
  using enum FindingCode;
  constexpr std::array kMisreadings = {time_unit, increments,     not_increments, clocks,
                                       gyro_unit, reference_unit, reference_axes, fractions};
  return std::ranges::find(kMisreadings, finding.code) != kMisreadings.end();
}

std::vector<Finding> inspect(const Recording& recording, const Robot* robot) {
  if (recording.wheels.time_s.empty()) return {};
  const std::span<const WheelSeries> all = recording.wheels.series;
  const std::span<const WheelSeries> series = all.first(std::min<std::size_t>(all.size(), kMaxWheels));
  Robot columns = robot_of_columns(series);
  std::vector<int> guessed(series.size());
  for (std::size_t i = 0; i < guessed.size(); ++i) {
    const int told = robot == nullptr ? 0 : told_bits(series[i], *robot);
    guessed[i] = told > 0 ? 0 : guessed_bits(recording, series[i]);
    columns.chassis.wheels()[i].tick_bits = std::max(told, guessed[i]);
  }
  const AlignedReadings readings = align(recording, columns);
  std::vector<Finding> problems = readings.findings;
  for (Finding& problem : problems) {
    if (problem.code != FindingCode::wrap) continue;
    const auto wheel = std::ranges::find(columns.wheel_names, problem.subjects.front());
    if (const int bits = guessed[static_cast<std::size_t>(wheel - columns.wheel_names.begin())]; bits > 0)
      problem.payload = payload::Amount{static_cast<double>(bits)};
  }
  find_stuck(recording, courses_of(readings, columns), problems);
  return problems;
}

std::vector<Finding> inspect(const Recording& recording, const Robot& robot,
                             const AlignedReadings& readings) {
  std::vector<Finding> problems = readings.findings;
  if (const auto unit = wrong_gyro_unit(recording, robot, readings)) {
    std::erase_if(problems, [](const Finding& p) { return is_of_gyro(p.code); });
    problems.push_back(*unit);
    return problems;
  }
  if (robot.chassis.wheel_count > 0) {
    find_fractions(recording, robot, readings, problems);
    name_wraps(recording, robot, problems);
    find_stuck(recording, robot, readings, problems);
    compare_gyro(recording, robot, readings, problems);
  }
  return problems;
}

}  // namespace trundle::inspection
