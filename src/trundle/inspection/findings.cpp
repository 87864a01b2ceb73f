#include "trundle/inspection/findings.hpp"

#include <algorithm>
#include <span>
#include <utility>

#include "trundle/calibration/preparation/channel_assignment.hpp"
#include "trundle/calibration/preparation/reversed_wheel.hpp"
#include "trundle/chassis/rows.hpp"
#include "trundle/inspection/clocks.hpp"
#include "trundle/inspection/counts_read_otherwise.hpp"
#include "trundle/inspection/detail/reference_checks.hpp"
#include "trundle/inspection/geometry_checks.hpp"
#include "trundle/inspection/partial_reference_checks.hpp"
#include "trundle/inspection/sighting_checks.hpp"
#include "trundle/inspection/steering_checks.hpp"
#include "trundle/inspection/wheel_checks.hpp"
#include "trundle/io/error.hpp"

namespace trundle::inspection {
namespace {

bool is_misread(const Findings& findings) {
  return std::ranges::any_of(findings.problems, is_misreading);
}

bool warns_of(FindingCode code, const std::vector<Finding>& problems) {
  return std::ranges::any_of(problems, [&](const Finding& problem) {
    return problem.severity == Severity::warning && problem.code == code;
  });
}

void append(std::vector<Finding>& problems, const std::vector<Finding>& more) {
  problems.insert(problems.end(), more.begin(), more.end());
}

/// Nothing where the recording does not suit the robot.
std::optional<Overview> overview_if_possible(const Recording& recording, const Robot& robot) {
  try {
    return overview_of(recording, robot);
  } catch (const InputError&) {
    return std::nullopt;
  }
}

/// Streams that were never recorded together.
void compare_times(const Findings& findings, const Recording& recording, std::vector<Finding>& problems) {
  if (findings.streams.empty()) return;
  const StreamSummary& first = findings.streams.front();
  for (const StreamSummary& other : findings.streams)
    if (other.start_s > first.end_s || other.end_s < first.start_s)
      problems.push_back({.code = FindingCode::clocks,
                          .place = recording.name,
                          .subjects = {first.stream, other.stream},
                          .payload = payload::Spans{first.start_s, first.end_s, other.start_s, other.end_s}});
}

bool is_shown_by_gyro(FindingCode code) {
  return code == FindingCode::gyro_sign || code == FindingCode::reversed_counter ||
         code == FindingCode::reversed_wheel;
}

/// What the gyro shows of wheels.
void turn_around_as_shown(const std::vector<Finding>& problems, Robot& robot) {
  for (const Finding& problem : problems) {
    if (!is_miswiring(problem) || problem.subjects.empty()) continue;
    const auto named = std::ranges::find(robot.wheel_names, problem.subjects.front());
    if (named == robot.wheel_names.end()) continue;
    const auto wheel = static_cast<std::size_t>(named - robot.wheel_names.begin());
    if (problem.code == FindingCode::reversed_counter) turn_around(wheel, true, robot);
    if (problem.code == FindingCode::reversed_wheel) turn_around(wheel, false, robot);
  }
}

/// Columns that do not belong to the wheels whose names they bear. The reference shows it better than the
/// gyro. Returns the robot with its channels as they are shown.
Robot compare_channels(const Recording& recording, const Run* run, const Robot& robot,
                       std::vector<Finding>& problems) {
  ChannelAssignment channels =
      run != nullptr ? check_channels(recording, *run, robot) : check_channels({&recording, 1}, robot);
  if (channels.faults.empty())
    turn_around_as_shown(problems, channels.robot);
  else
    std::erase_if(problems, [](const Finding& p) { return is_miswiring(p) && is_shown_by_gyro(p.code); });
  for (std::vector<Finding>* const found : {&channels.faults, &channels.ambiguous})
    for (Finding& finding : *found) {
      finding.place = recording.wheels.origin.file;
      problems.push_back(std::move(finding));
    }
  return channels.robot;
}

/// The track that the ground gives, where wheels must scrub in turns.
void find_tracks(const Recording& recording, const Robot& robot, Findings& findings) {
  if (!has_skid_wheels(robot.chassis) || !EffectiveTrack::applies_to(robot.chassis) ||
      recording.gyro.time_s.empty())
    return;
  findings.tracks = effective_tracks(recording, robot);
}

/// Of "file:line".
std::string file_of(const std::string& place) {
  const std::size_t digits = place.find_last_not_of("0123456789");
  return digits == place.npos || place[digits] != ':' ? place : place.substr(0, digits);
}

/// Nobody reads the same fault twice, or hundreds of a kind in a file: of more than kMostOfAKind those beyond
/// are counted by one more.
std::vector<Finding> folded(const std::vector<Finding>& problems) {
  constexpr std::ptrdiff_t kMostOfAKind = 20;  // lines: a terminal has 24
  // What was measured may differ in its last digit: it follows from what is compared.
  const auto same = [](const Finding& a) {
    return [&a](const Finding& b) {
      return a.severity == b.severity && a.code == b.code && a.place == b.place && a.count == b.count &&
             a.subjects == b.subjects && a.payload.index() == b.payload.index();
    };
  };
  std::vector<Finding> once;
  for (const Finding& problem : problems)
    if (std::ranges::none_of(once, same(problem))) once.push_back(problem);
  std::vector<Finding> result;
  std::vector<Finding> beyond;  // one for each kind and file
  for (const Finding& problem : once) {
    const auto of_kind = [&](const Finding& other) {
      return other.code == problem.code && file_of(other.place) == file_of(problem.place);
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
  for (Finding& problem : beyond) {
    problem.payload = payload::Further{};
    result.push_back(std::move(problem));
  }
  std::stable_partition(result.begin(), result.end(), is_misreading);
  return result;
}

/// One cause is told once: wires before sizes, and sizes by the reference before those by the gyro.
void drop_consequences(std::vector<Finding>& problems) {
  const auto forget = [&](FindingCode code) {
    std::erase_if(problems, [&](const Finding& problem) { return problem.code == code; });
  };
  const bool are_miswired = std::ranges::any_of(problems, is_miswiring);
  if (are_miswired || warns_of(FindingCode::scale, problems)) forget(FindingCode::gyro_against_wheels);
}

/// Of a recording that is held against more than its own sensors: what for all readings are needed at once.
struct Compared {
  std::optional<Run> run = {};  ///< where there is a reference
  AlignedReadings own = {};     ///< else

  const AlignedReadings& readings() const { return run ? run->readings : own; }
};

/// Nothing where it holds no more.
std::optional<Compared> compared(const Recording& recording, const Robot& robot) {
  if (!recording.reference.time_s.empty()) return Compared{.run = prepare_run(recording, robot)};
  if (recording.partial.empty() && recording.sightings.empty()) return std::nullopt;
  return Compared{.own = align(recording, robot)};
}

void compare_all_clocks(const Recording& recording, const Overview& overview,
                        const std::optional<Compared>& all, const Robot& robot, Findings& findings) {
  const BoardClocks board = compare_clocks(recording, robot, overview.gyro_time_offset);
  findings.compares_clocks = board.gyro.is_possible;
  findings.gyro_time_offset = board.gyro.offset;
  findings.compares_steering_clock = board.steering.is_possible;
  findings.steering_time_offset = board.steering.offset;
  ClockComparison reference, sightings;
  if (all) {
    // Their clocks are told by the motion, which a steering or a gyro that is late makes another.
    std::optional<AlignedReadings> corrected;
    if (board.steering.is_off() || board.gyro.is_off()) {
      Robot told = robot;
      if (board.steering.is_off())
        move_steering_clock(board.steering.offset->offset_s - steering_time_offset_s(robot.chassis),
                            told.chassis);
      if (board.gyro.is_off()) told.chassis.gyro->time_offset_s = board.gyro.offset->offset_s;
      corrected = align(recording, told);
    }
    const AlignedReadings& readings = corrected ? *corrected : all->readings();
    reference = compare_reference_clock(recording, readings, robot);
    sightings = compare_sighting_clock(recording, readings, robot);
  }
  findings.compares_reference_clock = reference.is_possible;
  findings.reference_time_offset = reference.offset;
  findings.compares_sighting_clock = sightings.is_possible;
  findings.sighting_time_offset = sightings.offset;
  for (const auto& problem :
       {board.gyro.problem, board.steering.problem, reference.problem, sightings.problem})
    if (problem) findings.problems.push_back(*problem);
}

/// How many times as far the reference moves, which wrong wires make another number.
bool is_of_length(const Finding& problem) {
  return std::holds_alternative<payload::LengthRatio>(problem.payload) &&
         (problem.code == FindingCode::reference_unit || problem.code == FindingCode::scale);
}

/// Units of the reference, and wires; where these are wrong, lengths as they show with the right ones.
void compare_wires(const Recording& recording, const Run* run, const Robot& robot, Findings& findings) {
  std::vector<Finding>& problems = findings.problems;
  if (run != nullptr) compare_references(recording, *run, robot, problems);
  const bool hides_wires =
      std::ranges::any_of(problems, [](const Finding& p) { return is_misreading(p) && !is_of_length(p); });
  if (hides_wires || robot.chassis.wheel_count == 0) return drop_consequences(problems);
  const Robot wired = compare_channels(recording, run, robot, problems);
  if (run != nullptr) find_mirrored_path(recording, *run, robot, problems);
  drop_consequences(problems);
  if (run == nullptr || std::ranges::none_of(problems, is_miswiring)) return;
  std::erase_if(problems, is_of_length);
  compare_references(recording, prepare_run(recording, wired), wired, problems);
}

void compare(const Recording& recording, const Robot& robot, Findings& findings) {
  findings.abilities = abilities_of(robot, robot.chassis.gyro && !recording.gyro.time_s.empty());
  append(findings.problems, wrong_geometry(robot));
  find_wrong_columns(recording, robot, findings.problems);
  if (is_misread(findings)) return;
  const std::optional<Overview> overview = overview_if_possible(recording, robot);
  if (overview)
    for (const auto read_otherwise : {wrong_steering, counts_read_otherwise})
      if (const auto problem = read_otherwise(recording, robot, *overview)) {
        findings.problems.push_back(*problem);
        return;
      }
  append(findings.problems, overview ? inspect(recording, robot, *overview) : inspect(recording, &robot));
  if (!overview)
    findings.abilities = {
        .can = {}, .cannot = {"anything with this recording: it does not give what the robot file asks for"}};
  if (!overview || is_misread(findings)) return;
  find_mirrored_reference(recording, robot, findings.problems);
  find_one_column_for_two(recording, *overview, robot, findings.problems);
  const std::optional<Compared> all = compared(recording, robot);
  compare_wires(recording, all && all->run ? &*all->run : nullptr, robot, findings);
  // A clock, a length and a landmark are told by the motion, which wrong wires make another.
  if (std::ranges::any_of(findings.problems, is_miswiring)) return;
  find_contrary_wheels(recording, *overview, robot, findings.problems);
  if (all) {
    append(findings.problems, wrong_partial_reference(recording, robot, all->readings()));
    if (const auto wrong = wrong_sightings(recording, robot, all->readings()))
      findings.problems.push_back(*wrong);
  }
  if (is_misread(findings)) return;
  compare_all_clocks(recording, *overview, all, robot, findings);
  find_tracks(recording, robot, findings);
}

}  // namespace

Findings find_in(const Recording& recording, const Robot* robot) {
  Findings findings;
  findings.streams = summaries_of(recording);
  findings.steerings = steerings_of(recording, robot);
  findings.problems = recording.findings;
  findings.missing = missing_in(recording, robot);
  find_wrong_time_unit(recording, findings.streams, findings.problems);
  if (!is_misread(findings)) compare_times(findings, recording, findings.problems);
  if (robot != nullptr) {
    compare(recording, *robot, findings);
  } else if (!is_misread(findings)) {
    append(findings.problems, inspect(recording));
  }
  findings.problems = folded(findings.problems);
  return findings;
}

}  // namespace trundle::inspection
