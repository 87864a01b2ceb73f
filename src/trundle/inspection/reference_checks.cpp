#include "trundle/inspection/detail/reference_checks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "trundle/calibration/preparation/initial_scale.hpp"
#include "trundle/calibration/preparation/sense_of_turning.hpp"
#include "trundle/chassis/rows.hpp"
#include "trundle/inspection/detail/roll_ahead.hpp"
#include "trundle/inspection/mirrored_reference.hpp"
#include "trundle/inspection/reference_turns.hpp"
#include "trundle/recording/csv/detail/table.hpp"
#include "trundle/recording/turns.hpp"

namespace trundle::inspection {
namespace {

/// How far the reference turns where degrees were taken for radians, or the other way round; nothing:
/// neither. `scale`: how many times as far the reference moves, which wheels of another size explain, and its
/// turns with it.
std::optional<Payload> heading_unit_fault(const PairedSums& turns, double scale) {
  constexpr double kTrackIsKnown = 1.3;  // the factor that its ratio to degrees may be off
  const auto are_degrees = [](double ratio) {
    return ratio < degrees(kTrackIsKnown) && ratio > degrees(1.0) / kTrackIsKnown;
  };
  if (std::sqrt(turns.xx) < kLeastTurning_rad || !(std::abs(turns.correlation()) > 0.8)) return std::nullopt;
  const double ratio = std::abs(turns.slope()) / scale;
  if (are_degrees(ratio)) return payload::Times{ratio};
  if (are_degrees(1.0 / ratio)) return payload::Share{ratio};
  return std::nullopt;
}

/// Whether the reference turns the other way than wheels and gyro, which agree.
bool turns_the_other_way(const Recording& recording, const AlignedReadings& readings, const Robot& robot) {
  constexpr double kOtherWay = -0.8;  // correlation
  const auto of_gyro = comparable_turns(recording, robot, readings);
  if (!of_gyro || of_gyro->correlation() < kTurnsAgree) return false;
  const PairedSums turns = turns_of_reference(recording.reference, readings, robot);
  return std::sqrt(turns.xx) > kLeastTurning_rad && turns.correlation() < kOtherWay;
}

bool gyro_contradicts(const std::vector<Finding>& problems) {
  return std::ranges::any_of(problems, [](const Finding& problem) {
    return problem.severity == Severity::warning && problem.code == FindingCode::gyro_against_wheels;
  });
}

}  // namespace

void find_wrong_time_unit(const Recording& recording, std::span<const StreamSummary> streams,
                          std::vector<Finding>& problems) {
  constexpr std::array<std::pair<const char*, double>, 3> kUnits = {{{"ms", 1e3}, {"us", 1e6}, {"ns", 1e9}}};
  constexpr double kAboutAsLong = 2.0;  // a log that starts late or ends early
  const auto& t = recording.reference.time_s;
  if (streams.empty() || t.size() < 2) return;
  const StreamSummary& first = streams.front();
  const double times = (t.back() - t.front()) / (first.end_s - first.start_s);
  for (const auto& [unit, in_second] : kUnits)
    if (times > in_second / kAboutAsLong && times < in_second * kAboutAsLong)
      problems.push_back({.code = FindingCode::time_unit,
                          .place = recording.reference.origin.file,
                          .payload = payload::StampStep{median_step(t), unit}});
}

void find_mirrored_path(const Recording& recording, const Run& run, const Robot& robot,
                        std::vector<Finding>& problems) {
  if (!is_steered(robot.chassis) || run.reference.has_headings() ||
      std::ranges::any_of(problems, is_miswiring) || !positions_bend_against_wheels({&run, 1}, robot))
    return;
  Finding mirrored{.code = FindingCode::reversed_steering, .place = recording.wheels.origin.file};
  for (std::size_t i = 0; i < robot.chassis.all_wheels().size(); ++i)
    if (robot.chassis.all_wheels()[i].steering) mirrored.subjects.push_back(wheel_name(robot, i));
  problems.push_back(std::move(mirrored));
}

void compare_references(const Recording& recording, const Run& run, const Robot& robot,
                        std::vector<Finding>& problems) {
  const std::string& file = recording.reference.origin.file;
  if (has_skid_wheels(robot.chassis) || observability(rows_of(robot.chassis, false)).rank < 3) return;
  if (turns_the_other_way(recording, run.readings, robot)) {
    problems.push_back(
        {.code = FindingCode::reference_axes, .place = file, .payload = payload::Amount{-1.0}});
    return;
  }
  const std::span runs(&run, 1);
  const std::optional<ScaleFault> fault = scale_fault(runs, robot);
  if (const std::optional<Payload> turns =
          heading_unit_fault(turns_of_reference(recording.reference, run.readings, robot),
                             fault && fault->scale.turns_too ? fault->scale.times : 1.0))
    problems.push_back({.code = FindingCode::reference_unit, .place = file, .payload = *turns});
  if (!fault || !stretches_agree(runs, robot)) return;
  // A gyro that contradicts the wheels as well acquits the reference.
  const bool is_of_unit = fault->is_of_unit && !gyro_contradicts(problems);
  problems.push_back({.code = is_of_unit ? FindingCode::reference_unit : FindingCode::scale,
                      .place = file,
                      .payload = fault->ratio});
}

void find_mirrored_reference(const Recording& recording, const Robot& robot, std::vector<Finding>& problems) {
  if (!all_roll_ahead(robot.chassis) || !is_mirrored(recording.reference)) return;
  problems.push_back({.code = FindingCode::reference_axes, .place = recording.reference.origin.file});
}

}  // namespace trundle::inspection
