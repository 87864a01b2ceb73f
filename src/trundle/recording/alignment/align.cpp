#include "trundle/recording/alignment/align.hpp"

#include <cmath>
#include <iterator>
#include <optional>

#include "trundle/recording/alignment/replay.hpp"

namespace trundle::recording {
namespace {

/// What the gyro turned in at least so long, from an increment on, forwards or backwards; nothing across
/// gaps.
struct Turned {
  double gyro_rad = 0.0;
  double duration_s = 0.0;

  template <class Iterator>
  static std::optional<Turned> over(Iterator from, Iterator end) {
    Turned turned;
    for (; from != end && from->has_gyro; ++from) {
      turned.gyro_rad += from->gyro_rad;
      turned.duration_s += from->duration_s;
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
  GyroIntegral integral(*robot.chassis.gyro, AlignerOptions{}.shortest_gap_s);
  std::size_t row = 0;
  const auto angle_at = [&](double time_s) {
    for (; row < gyro.time_s.size() && integral.is_awaited(time_s); ++row)
      integral.add(gyro.time_s[row], gyro.yaw_rate_rad_s[row]);
    integral.forget_before(time_s);
    return integral.at(time_s);
  };
  GyroIntegral::Reading start = angle_at(aligned.start_s);
  for (Increment& increment : aligned.increments) {
    const GyroIntegral::Reading end = angle_at(increment.time_s);
    const std::optional<double> turn = GyroIntegral::turn(start, end);
    increment.gyro_rad = turn.value_or(0.0);
    increment.has_gyro = turn.has_value();
    start = end;
  }
}

void centre_gyro_changes(AlignedReadings& aligned) {
  std::vector<Increment>& increments = aligned.increments;
  double before = kNotMeasured;  // rate at the start of the increment
  for (std::size_t i = 0; i < increments.size(); ++i) {
    const auto next = increments.begin() + static_cast<std::ptrdiff_t>(i + 1);
    const auto later = Turned::over(next, increments.end());
    const auto earlier = Turned::over(std::make_reverse_iterator(next), increments.rend());
    const double after =
        later && earlier ? (later->gyro_rad + earlier->gyro_rad) / (later->duration_s + earlier->duration_s)
                         : kNotMeasured;
    const double change = after - before;
    increments[i].gyro_change_rad_s = std::isnan(change) ? 0.0 : change;
    before = after;
  }
}

}  // namespace trundle::recording
