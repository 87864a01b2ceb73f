#include "trundle/inspection/inspect.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <string_view>

#include "trundle/inspection/detail/gyro_checks.hpp"
#include "trundle/inspection/detail/roll_ahead.hpp"
#include "trundle/recording/alignment/replay.hpp"
#include "trundle/statistics/distribution.hpp"

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
    Replay replay(recording, robot);
    while (replay.next()) continue;
    return breaks_among(replay.findings());
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
int given_bits(const WheelSeries& series, const Robot& robot) {
  const auto named = std::ranges::find(robot.wheel_names, series.wheel);
  if (series.unit != WheelUnit::ticks || named == robot.wheel_names.end()) return 0;
  return robot.chassis.wheels()[static_cast<std::size_t>(named - robot.wheel_names.begin())].tick_bits;
}

std::string place_at(const Recording& recording, double time_s) {
  const auto& stamps = recording.wheels.time_s;
  const auto row = std::ranges::lower_bound(stamps, time_s - 1e-9);
  return recording.wheels.origin.place_of(static_cast<std::size_t>(row - stamps.begin()));
}

/// Without knowing the robot: it stands still while every other wheel goes at least a twentieth of its whole
/// way.
void find_stuck(const Recording& recording, const std::vector<std::string>& wheels, const Overview& overview,
                std::vector<Finding>& problems) {
  constexpr double kShare = 0.05;  // less may be a robot that hardly moves, all wheels alike
  if (wheels.size() < 2) return;
  for (std::size_t w = 0; w < wheels.size(); ++w)
    for (const Standstill& still : overview.standstills[w]) {
      bool others_move = true;
      for (std::size_t other = 0; other < wheels.size() && others_move; ++other)
        others_move =
            other == w || (overview.way[other] > 0.0 && still.way[other] >= kShare * overview.way[other]);
      if (!others_move) continue;
      problems.push_back({.code = FindingCode::stuck_encoder,
                          .place = place_at(recording, still.start_s),
                          .subjects = {wheels[w]},
                          .payload = payload::Amount{still.duration_s()}});
    }
}

void find_stuck(const Recording& recording, const Robot& robot, const Overview& overview,
                std::vector<Finding>& problems) {
  constexpr double kLeastTravel = 0.05;  // [m]
  bool all_expected = true;
  for (std::size_t w = 0; w < robot.wheel_names.size(); ++w)
    for (const Standstill& still : overview.standstills[w]) {
      all_expected = all_expected && still.expected_m.has_value();
      const double least_m = std::max(kLeastTravel, kSignificant * still.expected_sigma_m);
      if (!still.expected_m || std::abs(*still.expected_m) < least_m) continue;
      problems.push_back({.code = FindingCode::stuck_encoder,
                          .place = place_at(recording, still.start_s - robot.chassis.wheels_time_offset_s),
                          .subjects = {robot.wheel_names[w]},
                          .payload = payload::Standstill{.duration_s = still.duration_s(),
                                                         .expected_m = *still.expected_m}});
    }
  if (!all_expected && all_roll_ahead(robot.chassis))
    find_stuck(recording, robot.wheel_names, overview, problems);
}

/// The first row of those that hold fractions, where half do: a column of metres or of speeds that is taken
/// for counts hardly turns its wheel.
std::optional<std::size_t> first_fraction(std::span<const double> counts) {
  const auto broken = [](double v) { return !std::isnan(v) && v != std::round(v); };
  if (2 * std::ranges::count_if(counts, broken) < std::ssize(counts)) return std::nullopt;
  return static_cast<std::size_t>(std::ranges::find_if(counts, broken) - counts.begin());
}

/// The first row that differs from the one before by a part of a count, where half of those that differ do.
std::optional<std::size_t> first_part_of_count(std::span<const double> counts) {
  constexpr double kRounding = 1e-6;  // of sums of counts that were scaled
  std::optional<std::size_t> first;
  std::size_t changes = 0, parts = 0;
  for (std::size_t i = 1; i < counts.size(); ++i) {
    const double change = std::abs(counts[i] - counts[i - 1]);
    if (!(change > kRounding)) continue;
    ++changes;
    if (std::abs(change - std::round(change)) <= kRounding) continue;
    ++parts;
    if (!first) first = i;
  }
  return 2 * parts >= changes ? first : std::nullopt;
}

/// Counts are whole.
void find_fractions(const Recording& recording, const Robot& robot, const Overview& overview,
                    std::vector<Finding>& problems) {
  for (const auto& [wheel, unit, counts] : recording.wheels.series) {
    const auto named = std::ranges::find(robot.wheel_names, wheel);
    if (unit != WheelUnit::ticks || named == robot.wheel_names.end()) continue;
    const bool turns = overview.way[static_cast<std::size_t>(named - robot.wheel_names.begin())] > 1.0;
    const std::optional<std::size_t> row = turns ? first_part_of_count(counts) : first_fraction(counts);
    if (!row) continue;
    problems.push_back(
        {.code = turns ? FindingCode::finer_than_counts : FindingCode::fractions,
         .place = recording.wheels.origin.place_of(*row),
         .subjects = {wheel},
         .payload = payload::Amount{turns ? std::abs(counts[*row] - counts[*row - 1]) : counts[*row]}});
  }
}

/// Counters that wrap where the robot file says otherwise look as if they started again.
void name_wraps(const Recording& recording, const Robot& robot, std::vector<Finding>& problems) {
  for (const WheelSeries& series : recording.wheels.series) {
    const auto named = std::ranges::find(robot.wheel_names, series.wheel);
    const auto is_break = [&](const Finding& problem) {
      return (problem.code == FindingCode::counter_reset || problem.code == FindingCode::counter_jump) &&
             problem.subjects.front() == series.wheel;
    };
    if (named == robot.wheel_names.end() || std::ranges::none_of(problems, is_break)) continue;
    const int bits = guessed_bits(recording, series);
    if (bits == 0) continue;
    const auto index = static_cast<std::size_t>(named - robot.wheel_names.begin());
    if (robot.chassis.wheels()[index].tick_bits == bits) continue;
    std::erase_if(problems, is_break);
    problems.push_back({.code = FindingCode::tick_bits,
                        .place = recording.wheels.origin.file,
                        .subjects = {series.wheel},
                        .payload = payload::Amount{static_cast<double>(bits)}});
  }
}

/// What wheels and gyro say of each other; a bias that is known to be wrong is none of it.
void compare_gyro(const Recording& recording, const Robot& robot, const Overview& overview,
                  std::vector<Finding>& problems) {
  const auto compare_with = [&](const Robot& right, const Overview& seen) {
    find_stuck(recording, right, seen, problems);
    return wrong_turns(recording, right, seen, !has_dead_counts(problems));
  };
  const std::optional<Finding> bias = wrong_gyro_bias(recording, robot, overview);
  std::optional<Finding> wrong;
  if (bias) {
    Robot with_bias = robot;
    with_bias.chassis.gyro->bias_rad_s = std::get<payload::SteadyRate>(bias->payload).rate_rad_s;
    wrong = compare_with(with_bias, overview_of(recording, with_bias));
    if (!wrong) wrong = bias;  // in rpm, bias and turns are both many times too large
  } else {
    wrong = compare_with(robot, overview);
  }
  if (wrong) problems.push_back(*std::move(wrong));
}

/// What a gyro in another unit makes seem to be wrong.
bool is_of_gyro(FindingCode code) {
  using enum FindingCode;
  constexpr std::array kOfGyro = {gyro_missing, gyro_saturated, gyro_disturbed,      gyro_beyond_its_bias,
                                  gyro_bias,    gyro_sign,      gyro_against_wheels, gyro_unit};
  return std::ranges::find(kOfGyro, code) != kOfGyro.end();
}

}  // namespace

bool is_misreading(const Finding& finding) {
  using enum FindingCode;
  constexpr std::array kMisreadings = {time_unit,      increments,    not_increments,     clocks,
                                       gyro_unit,      steering_unit, steering_direction, reference_unit,
                                       reference_axes, fractions};
  return std::ranges::find(kMisreadings, finding.code) != kMisreadings.end();
}

bool is_miswiring(const Finding& finding) {
  using enum FindingCode;
  constexpr std::array kMiswirings = {
      swapped_channels,         misplaced_channel, reversed_counter,  reversed_wheel,
      indistinguishable_wheels, reversed_gyro,     reversed_steering, gyro_sign};
  return finding.severity == Severity::warning &&
         std::ranges::find(kMiswirings, finding.code) != kMiswirings.end();
}

bool has_dead_counts(const std::vector<Finding>& problems) {
  using enum FindingCode;
  return std::ranges::any_of(problems, [](const Finding& problem) {
    return problem.code == stuck_encoder || problem.code == counter_reset || problem.code == counter_jump;
  });
}

std::vector<Finding> inspect(const Recording& recording, const Robot* robot) {
  if (recording.wheels.time_s.empty()) return {};
  const std::span<const WheelSeries> all = recording.wheels.series;
  const std::span<const WheelSeries> series = all.first(std::min<std::size_t>(all.size(), kMaxWheels));
  Robot columns = robot_of_columns(series);
  std::vector<int> guessed(series.size());
  for (std::size_t i = 0; i < guessed.size(); ++i) {
    const int told = robot == nullptr ? 0 : given_bits(series[i], *robot);
    guessed[i] = told > 0 ? 0 : guessed_bits(recording, series[i]);
    columns.chassis.wheels()[i].tick_bits = std::max(told, guessed[i]);
  }
  const Overview overview = overview_of(recording, columns);
  std::vector<Finding> problems = overview.findings;
  for (Finding& problem : problems) {
    if (problem.code != FindingCode::wrap) continue;
    const auto wheel = std::ranges::find(columns.wheel_names, problem.subjects.front());
    if (const int bits = guessed[static_cast<std::size_t>(wheel - columns.wheel_names.begin())]; bits > 0)
      problem.payload = payload::Amount{static_cast<double>(bits)};
  }
  find_stuck(recording, columns.wheel_names, overview, problems);
  return problems;
}

std::vector<Finding> inspect(const Recording& recording, const Robot& robot, const Overview& overview) {
  std::vector<Finding> problems = overview.findings;
  if (const auto unit = wrong_gyro_unit(recording, robot, overview)) {
    std::erase_if(problems, [](const Finding& p) { return is_of_gyro(p.code); });
    problems.push_back(*unit);
    return problems;
  }
  if (robot.chassis.wheel_count > 0) {
    find_fractions(recording, robot, overview, problems);
    name_wraps(recording, robot, problems);
    compare_gyro(recording, robot, overview, problems);
    if (const auto loud = louder_gyro(recording, robot)) problems.push_back(*loud);
  }
  return problems;
}

}  // namespace trundle::inspection
