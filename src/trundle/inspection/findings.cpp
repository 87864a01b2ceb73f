#include "trundle/inspection/findings.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "trundle/calibration/channel_assignment.hpp"
#include "trundle/calibration/initial_scale.hpp"
#include "trundle/chassis/rows.hpp"
#include "trundle/inspection/clocks.hpp"
#include "trundle/inspection/mirrored_reference.hpp"
#include "trundle/io/error.hpp"
#include "trundle/io/words.hpp"
#include "trundle/recording/detail/gyro_against_wheels.hpp"

namespace trundle {
namespace {

bool is_misread(const Findings& findings) {
  return std::ranges::any_of(findings.problems, is_misreading);
}

bool warns_of(ProblemKind kind, const std::vector<Problem>& problems) {
  return std::ranges::any_of(problems, [&](const Problem& problem) {
    return problem.severity == Severity::warning && problem.kind == kind;
  });
}

void append(std::vector<Problem>& problems, const std::vector<Problem>& more) {
  problems.insert(problems.end(), more.begin(), more.end());
}

/// Nothing where the recording does not suit the robot.
std::optional<AlignedReadings> align_if_possible(const Recording& recording, const Robot& robot) {
  try {
    return align(recording, robot);
  } catch (const InputError&) {
    return std::nullopt;
  }
}

/// recording.toml where it maps the wheels; empty where they are read from wheels.csv.
std::string map_of_wheels(const Recording& recording) {
  const bool native = std::filesystem::path(recording.wheels.origin.file).filename() == "wheels.csv";
  return native ? std::string() : recording_toml_of(recording);
}

/// Columns of wheels that the robot has not got, where recording.toml asks for them.
void find_stray_wheels(const Recording& recording, const Robot& robot, std::vector<Problem>& problems) {
  const std::string map = map_of_wheels(recording);
  if (map.empty() || robot.wheel_names.empty()) return;
  for (const WheelSeries& series : recording.wheels.series) {
    if (std::ranges::find(robot.wheel_names, series.wheel) != robot.wheel_names.end()) continue;
    const std::string nearest = nearest_name(series.wheel, robot.wheel_names);
    problems.push_back(
        {Severity::warning, ProblemKind::unknown_wheel, map, 1,
         fmt::format("the robot file has no wheel '{}', so that column is not used: {}", series.wheel,
                     nearest.empty() ? fmt::format("its wheels are {}", fmt::join(robot.wheel_names, ", "))
                                     : fmt::format("is '{}' meant?", nearest))});
  }
}

/// Counts of wheels of which nothing says what a count is.
void find_unscaled_wheels(const Recording& recording, const Robot& robot, std::vector<Problem>& problems) {
  std::vector<std::string> names;
  std::string place;
  for (std::size_t i = 0; i < robot.wheel_names.size(); ++i) {
    const auto& series = recording.wheels.series;
    const auto mine = std::ranges::find(series, robot.wheel_names[i], &WheelSeries::wheel);
    if (mine == series.end() || mine->unit != WheelUnit::ticks ||
        robot.chassis.wheels()[i].ticks_per_revolution != 0.0)
      continue;
    if (names.empty()) place = place_of_wheel(robot, i);
    names.push_back("'" + robot.wheel_names[i] + "'");
  }
  if (names.empty()) return;
  problems.push_back(
      {Severity::warning, ProblemKind::ticks_per_revolution, place, 1,
       fmt::format("{} {} no ticks_per_revolution, and the recording gives counts: turn the wheel once by "
                   "hand and write how many counts that is",
                   fmt::join(names, " and "), names.size() == 1 ? "has" : "have")});
}

/// Streams that were never recorded together.
void compare_times(const Findings& findings, const Recording& recording, std::vector<Problem>& problems) {
  if (findings.streams.empty()) return;
  const StreamSummary& first = findings.streams.front();
  for (const StreamSummary& other : findings.streams)
    if (other.start_s > first.end_s || other.end_s < first.start_s)
      problems.push_back(
          {Severity::warning, ProblemKind::clocks, recording.name, 1,
           fmt::format("{} runs from {:.9g} to {:.9g} s, {} from {:.9g} to {:.9g} s, never at the same "
                       "time: another column of stamps, time_unit or time_offset_s?",
                       first.stream, first.start_s, first.end_s, other.stream, other.start_s, other.end_s)});
}

/// Columns that do not belong to the wheels whose names they bear.
void compare_channels(const Recording& recording, const AlignedReadings& readings, const Robot& robot,
                      Findings& findings) {
  const std::string& file = recording.wheels.origin.file;
  const ChannelAssignment channels = check_channels(recording, readings, robot);
  for (const std::string& fault : channels.faults)
    findings.problems.push_back({Severity::warning, ProblemKind::wiring, file, 1, fault});
  for (const std::string& pair : channels.ambiguous)
    findings.problems.push_back({Severity::note, ProblemKind::wiring, file, 1, pair});
}

PairedSums turns_of_reference(const ReferenceStream& reference, const AlignedReadings& readings,
                              const Robot& robot) {
  const auto heading_at = [&](double time_s) { return sample_reference(reference, time_s).value.z(); };
  double before = heading_at(readings.start_s);
  return turn_pairs(robot, readings, [&](const Increment& increment) {
    const double now = heading_at(increment.time_s);
    return now - std::exchange(before, now);
  });
}

/// Degrees that were taken for radians, or the other way round; in words, empty: neither. `scale`: how many
/// times as far the reference moves, which wheels of another size explain, and its turns with it.
std::string heading_unit_fault(const PairedSums& turns, double scale) {
  constexpr double kTrackIsKnown = 1.3;  // the factor that its ratio to degrees may be off
  const auto are_degrees = [](double ratio) {
    return ratio < degrees(kTrackIsKnown) && ratio > degrees(1.0) / kTrackIsKnown;
  };
  if (std::sqrt(turns.xx) < kLeastTurning_rad || !(std::abs(turns.correlation()) > 0.8)) return {};
  const double ratio = std::abs(turns.slope()) / scale;
  if (are_degrees(ratio))
    return fmt::format(
        "the reference turns {:.0f} times as far as the wheels; degrees would make it 57: write unit = "
        "\"deg\" at "
        "heading_rad in recording.toml",
        ratio);
  if (are_degrees(1.0 / ratio))
    return fmt::format(
        "the reference turns {:.2g} of what the wheels do, where radians taken for degrees would make it "
        "1/57: leave "
        "out unit = \"deg\"",
        ratio);
  return {};
}

/// The units of the reference: its way and its turns against the wheels', unless these scrub and slide.
void compare_references(const Recording& recording, const AlignedReadings& readings, const Robot& robot,
                        Findings& findings) {
  const std::string& file = recording.reference.origin.file;
  if (recording.reference.time_s.empty() || has_skid_wheels(robot.chassis) ||
      observability(rows_of(robot.chassis, false)).rank < 3)
    return;
  const std::vector<Run> runs = {prepare_run(recording, robot, readings)};
  const double times = initial_scale(runs, robot).value_or(1.0);
  const std::string turns =
      heading_unit_fault(turns_of_reference(recording.reference, readings, robot), times > 0.0 ? times : 1.0);
  if (!turns.empty())
    findings.problems.push_back({Severity::warning, ProblemKind::reference_unit, file, 1, turns});
  if (!stretches_agree(runs, robot)) return;
  const std::optional<ScaleFault> fault = scale_fault(runs, robot);
  if (!fault) return;
  // A gyro that contradicts the wheels as well acquits the reference.
  const bool is_of_unit = fault->is_of_unit && !warns_of(ProblemKind::gyro_against_wheels, findings.problems);
  findings.problems.push_back({Severity::warning,
                               is_of_unit ? ProblemKind::reference_unit : ProblemKind::scale, file, 1,
                               fault->message});
}

/// Of robots that roll where they look, the reference against itself.
void find_mirrored_reference(const Recording& recording, const Robot& robot, Findings& findings) {
  const auto rolls_ahead = [](const Wheel& w) {
    return w.kind == WheelKind::fixed || w.kind == WheelKind::skid;
  };
  if (robot.chassis.wheels().empty() || !std::ranges::all_of(robot.chassis.wheels(), rolls_ahead) ||
      !is_mirrored(recording.reference))
    return;
  findings.problems.push_back({Severity::warning, ProblemKind::reference_axes,
                               recording.reference.origin.file, 1,
                               "the path bends the other way than its headings turn: swap the columns of x_m "
                               "and y_m, or write sign = "
                               "-1 at one of them"});
}

/// Two wheels in one place show nothing that one does not.
void find_wheels_in_one_place(const Robot& robot, std::vector<Problem>& problems) {
  const auto wheels = robot.chassis.wheels();
  for (std::size_t i = 0; i < wheels.size(); ++i)
    for (std::size_t j = i + 1; j < wheels.size(); ++j)
      if (wheels[i].x_m == wheels[j].x_m && wheels[i].y_m == wheels[j].y_m &&
          wheels[i].direction_rad == wheels[j].direction_rad)
        problems.push_back({Severity::warning, ProblemKind::geometry, fmt::format("robot '{}'", robot.name),
                            1,
                            fmt::format("wheels '{}' and '{}' stand in one place: write x_m and y_m of both",
                                        robot.wheel_names[i], robot.wheel_names[j])});
}

/// The track that the ground gives, where wheels must scrub in turns.
void find_tracks(const Recording& recording, const AlignedReadings& readings, const Robot& robot,
                 Findings& findings) {
  if (!has_skid_wheels(robot.chassis) || !EffectiveTrack::applies_to(robot.chassis) ||
      recording.gyro.time_s.empty())
    return;
  findings.tracks = effective_tracks(readings, robot.chassis);
}

/// Of "file:line".
std::string file_of(const std::string& place) {
  const std::size_t digits = place.find_last_not_of("0123456789");
  return digits == place.npos || place[digits] != ':' ? place : place.substr(0, digits);
}

/// Nobody reads the same fault twice, or hundreds of a kind in a file: of more than kMostOfAKind those beyond
/// are counted by one more.
std::vector<Problem> folded(const std::vector<Problem>& problems) {
  constexpr std::ptrdiff_t kMostOfAKind = 20;
  const auto same = [](const Problem& a) {
    return [&a](const Problem& b) {
      return a.severity == b.severity && a.kind == b.kind && a.place == b.place && a.message == b.message;
    };
  };
  std::vector<Problem> once;
  for (const Problem& problem : problems)
    if (std::ranges::none_of(once, same(problem))) once.push_back(problem);
  std::vector<Problem> result;
  std::vector<Problem> beyond;  // one for each kind and file
  for (const Problem& problem : once) {
    const auto of_kind = [&](const Problem& other) {
      return other.kind == problem.kind && file_of(other.place) == file_of(problem.place);
    };
    if (std::ranges::count_if(result, of_kind) < kMostOfAKind) {
      result.push_back(problem);
    } else if (const auto further = std::ranges::find_if(beyond, of_kind); further != beyond.end()) {
      ++further->count;
    } else {
      beyond.push_back(problem);
      beyond.back().count = 1;
    }
  }
  for (Problem& problem : beyond) {
    problem.message = fmt::format("and {} more places of this kind, from here on", problem.count);
    result.push_back(std::move(problem));
  }
  std::ranges::stable_partition(result, is_misreading);
  return result;
}

/// One cause is told once: the reference knows better than the gyro, and wires before sizes.
void forget_what_is_told_already(std::vector<Problem>& problems) {
  const bool of_wiring = warns_of(ProblemKind::wiring, problems);
  const auto forget = [&](ProblemKind kind) {
    std::erase_if(problems, [&](const Problem& problem) { return problem.kind == kind; });
  };
  if (of_wiring) forget(ProblemKind::scale);
  if (!of_wiring && !warns_of(ProblemKind::scale, problems)) return;
  forget(ProblemKind::gyro_sign);
  forget(ProblemKind::gyro_against_wheels);
}

void compare(const Recording& recording, const Robot& robot, Findings& findings) {
  findings.abilities = abilities_of(robot, robot.chassis.gyro && !recording.gyro.time_s.empty());
  find_wheels_in_one_place(robot, findings.problems);
  find_stray_wheels(recording, robot, findings.problems);
  find_unscaled_wheels(recording, robot, findings.problems);
  if (is_misread(findings)) return;
  const std::optional<AlignedReadings> readings = align_if_possible(recording, robot);
  append(findings.problems, readings ? inspect(recording, robot, *readings) : inspect(recording, &robot));
  if (!readings)
    findings.abilities = {
        .can = {}, .cannot = {"anything with this recording: it does not give what the robot file asks for"}};
  if (!readings || is_misread(findings)) return;
  find_mirrored_reference(recording, robot, findings);
  compare_references(recording, *readings, robot, findings);
  if (is_misread(findings)) return;
  compare_channels(recording, *readings, robot, findings);
  forget_what_is_told_already(findings.problems);
  const ClockComparison clocks = compare_clocks(recording, *readings, robot);
  findings.compares_clocks = clocks.is_possible;
  findings.gyro_time_offset = clocks.offset;
  if (clocks.problem) findings.problems.push_back(*clocks.problem);
  find_tracks(recording, *readings, robot, findings);
}

}  // namespace

Findings find_in(const Recording& recording, const Robot* robot) {
  Findings findings;
  findings.streams = summaries_of(recording);
  findings.problems = recording.problems;
  findings.missing = missing_in(recording, robot);
  compare_times(findings, recording, findings.problems);
  if (robot != nullptr) {
    compare(recording, *robot, findings);
  } else if (!is_misread(findings)) {
    append(findings.problems, inspect(recording));
  }
  findings.problems = folded(findings.problems);
  return findings;
}

}  // namespace trundle
