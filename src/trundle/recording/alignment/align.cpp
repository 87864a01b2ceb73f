#include "trundle/recording/alignment/align.hpp"

#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "trundle/chassis/tyre_growth.hpp"
#include "trundle/recording/alignment/gyro_turns.hpp"
#include "trundle/recording/alignment/replay.hpp"

namespace trundle::recording {
namespace {

/// What the gyro turned in each increment; NaN where that is not known.
std::vector<double> gyro_turns_of(const Increments& increments) {
  std::vector<double> turn_rad;
  turn_rad.reserve(increments.size());
  for (std::size_t i = 0; i < increments.size(); ++i) turn_rad.push_back(increments.gyro_rad(i));
  return turn_rad;
}

/// What it turned in at least so long, from an increment on, forwards or backwards; nothing across gaps.
struct Turned {
  double gyro_rad = 0.0;
  double duration_s = 0.0;

  static std::optional<Turned> over(const Increments& increments, std::span<const double> turn_rad,
                                    std::size_t from, int step) {
    Turned turned;
    for (std::size_t i = from; i < turn_rad.size(); i += static_cast<std::size_t>(step)) {
      if (std::isnan(turn_rad[i])) break;
      turned.gyro_rad += turn_rad[i];
      turned.duration_s += increments.duration_s(i);
      if (turned.duration_s >= GyroIntegral::kRateOver_s - 1e-9) return turned;
    }
    return std::nullopt;
  }
};

}  // namespace

AlignedReadings align(const Recording& recording, const Robot& robot) {
  Replay replay(recording, robot);
  AlignedReadings aligned;
  aligned.increments.reserve(replay.most_intervals());
  while (const std::optional<AlignedInterval> interval = replay.next()) {
    aligned.increments.push_back(interval->increment);
    aligned.bridged.push_back(interval->bridged);
  }
  aligned.start_s = replay.start_s();
  aligned.findings = replay.findings();
  return aligned;
}

void add_gyro(const GyroStream& gyro, const Robot& robot, AlignedReadings& aligned) {
  if (!robot.chassis.gyro || gyro.time_s.empty() || aligned.increments.empty()) return;
  const GyroSamples samples(gyro, *robot.chassis.gyro);
  GyroTurns turns(samples, robot.chassis.gyro->time_offset_s, aligned.start_s);
  for (std::size_t i = 0; i < aligned.increments.size(); ++i) {
    Increment increment = aligned.increments[i];
    const std::optional<double> turn = turns.until(increment.time_s);
    increment.gyro_rad = turn.value_or(0.0);
    increment.has_gyro = turn.has_value();
    aligned.increments.set(i, increment);
  }
}

void add_speeds(const Chassis& chassis, AlignedReadings& aligned) {
  const SpeedGauge gauge(chassis);
  SpeedState state;
  for (std::size_t i = 0; i < aligned.increments.size(); ++i) {
    Increment increment = aligned.increments[i];
    gauge.add(state, increment);
    aligned.increments.set(i, increment);
  }
}

void centre_gyro_changes(AlignedReadings& aligned) {
  Increments& increments = aligned.increments;
  const std::vector<double> turn_rad = gyro_turns_of(increments);
  double before = kNotMeasured;  // rate at the start of the increment
  for (std::size_t i = 0; i < increments.size(); ++i) {
    const auto later = Turned::over(increments, turn_rad, i + 1, 1);
    const auto earlier = Turned::over(increments, turn_rad, i, -1);
    const double after =
        later && earlier ? (later->gyro_rad + earlier->gyro_rad) / (later->duration_s + earlier->duration_s)
                         : kNotMeasured;
    const double change = after - before;
    increments.set_gyro_change(i, std::isnan(change) ? 0.0 : change);
    before = after;
  }
}

}  // namespace trundle::recording
