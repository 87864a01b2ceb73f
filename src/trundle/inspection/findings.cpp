#include "trundle/inspection/findings.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "trundle/calibration/wiring.hpp"
#include "trundle/chassis/rows.hpp"
#include "trundle/io/error.hpp"

namespace trundle {
namespace {

constexpr double kSmallOffset_s = 0.005;  // does no harm

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

/// Columns that do not belong to the wheels whose names they bear.
void compare_wiring(const Recording& recording, const AlignedReadings& readings, const Robot& robot,
                    Findings& findings) {
  const std::string& file = recording.wheels.origin.file;
  const Wiring wiring = check_wiring(recording, readings, robot);
  for (const std::string& fault : wiring.faults)
    findings.problems.push_back({Severity::warning, "wiring", file, 1, fault});
  for (const std::string& pair : wiring.untold)
    findings.problems.push_back({Severity::note, "wiring", file, 1, pair});
}

bool has_two_clocks(const Recording& recording, const Robot& robot) {
  return robot.chassis.wheel_count > 0 && !recording.wheels.time_s.empty() && robot.chassis.gyro &&
         !recording.gyro.time_s.empty() && observability(rows_of(robot.chassis, false)).rank == 3;
}

/// The gyro's clock against the wheels'.
void compare_clocks(const Recording& recording, const AlignedReadings& readings, const Robot& robot,
                    Findings& findings) {
  findings.compares_clocks = has_two_clocks(recording, robot);
  if (!findings.compares_clocks) return;
  findings.gyro_time_offset = gyro_time_offset(recording, readings, robot);
  const auto& offset = findings.gyro_time_offset;
  if (!offset) return;
  const double off = offset->offset_s - robot.chassis.gyro->time_offset_s;
  if (std::abs(off) <= std::max(3.0 * offset->sigma_s, kSmallOffset_s)) return;
  findings.problems.push_back(
      {Severity::warning, "time offset", recording.gyro.origin.file, 1,
       fmt::format(
           "the gyro's stamps are {:.1f} ms too {} against the wheels', which looks like slip at every "
           "start of a turn: write time_offset_s = {:.4f} under [gyro]",
           1e3 * std::abs(off), off < 0.0 ? "late" : "early", offset->offset_s)});
}

/// The track that the ground gives, where wheels must scrub in turns.
void find_tracks(const Recording& recording, const AlignedReadings& readings, const Robot& robot,
                 Findings& findings) {
  const bool skids =
      std::ranges::any_of(robot.chassis.wheels(), [](const Wheel& w) { return w.kind == WheelKind::skid; });
  if (!skids || !EffectiveTrack::applies_to(robot.chassis) || recording.gyro.time_s.empty()) return;
  findings.tracks = effective_tracks(readings, robot.chassis);
}

void compare(const Recording& recording, const Robot& robot, Findings& findings) {
  const std::optional<AlignedReadings> readings = align_if_possible(recording, robot);
  append(findings.problems, readings ? inspect(recording, robot, *readings) : inspect(recording));
  findings.abilities = abilities_of(robot, robot.chassis.gyro && !recording.gyro.time_s.empty());
  if (!readings) return;
  compare_wiring(recording, *readings, robot, findings);
  compare_clocks(recording, *readings, robot, findings);
  find_tracks(recording, *readings, robot, findings);
}

}  // namespace

Findings find_in(const Recording& recording, const Robot* robot) {
  Findings findings;
  findings.streams = summaries_of(recording);
  findings.problems = recording.problems;
  findings.missing = missing_in(recording, robot);
  if (robot != nullptr) {
    compare(recording, *robot, findings);
  } else {
    append(findings.problems, inspect(recording));
  }
  return findings;
}

}  // namespace trundle
