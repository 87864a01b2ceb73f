#include "trundle/slip/slip_odometer.hpp"

namespace trundle::slip {

SlipOdometer::SlipOdometer(const Robot& robot, const Options& options)
    : odometer_(robot, options.odometry),
      detector_(robot, options.slip),
      merger_(robot.chassis, options.slip.interval_s),
      interval_start_(odometer_.state()),
      shortest_part_s_(options.slip.interval_s / static_cast<double>(kMostParts - 4)) {}

void SlipOdometer::keep(const Increment& increment) {
  if (part_count_ > 0 && parts_[part_count_ - 1].duration_s < shortest_part_s_)
    append(increment, parts_[part_count_ - 1]);
  else
    parts_[part_count_++] = increment;
}

std::optional<SlipVerdict> SlipOdometer::step(const Increment& increment, CommandChange command) {
  if (command.changed) command_ = command;
  keep(increment);
  odometer_.step(corrected(increment, applied_, detector_.parity().chassis()));
  const std::optional<Increment> interval = merger_.add(increment);
  if (!interval) return std::nullopt;
  const SlipVerdict verdict = detector_.step(
      {*interval, odometer_.gyro_bias(), merger_.turn_rate_change(), merger_.contacts()}, command_);
  if (verdict.correction != applied_) redo(verdict.correction);
  part_count_ = 0;
  command_ = {};
  interval_start_ = odometer_.state();
  return verdict;
}

/// The increments of this interval again, corrected otherwise. The next ones begin with the same correction.
void SlipOdometer::redo(const SlipCorrection& correction) {
  applied_ = correction;
  odometer_.resume(interval_start_);
  for (std::size_t i = 0; i < part_count_; ++i)
    odometer_.step(corrected(parts_[i], applied_, detector_.parity().chassis()));
}

SlipVerdict SlipOdometer::step_across_gap(const Increment& increment) {
  if (!applied_.none()) redo({});
  odometer_.step_across_gap(increment);
  merger_.reset();
  part_count_ = 0;
  command_ = {};
  interval_start_ = odometer_.state();
  return detector_.interrupt();
}

}  // namespace trundle::slip
