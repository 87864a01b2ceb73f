#include "trundle/calibration/likelihood/parity_windows.hpp"

#include <algorithm>
#include <functional>
#include <tuple>
#include <utility>

namespace trundle::calibration {

ParityWindows::Rigid::Rigid(const Chassis& chassis, const Chassis& weighing,
                            std::span<const Parameter> parameters, const WindowSums& given)
    : rows(rows_of(chassis, chassis.gyro.has_value())),
      comparison(comparison_of(chassis, rows, chassis, rows, left_null_space(rows), parameters)),
      rounding(rounding_of(chassis, rows)),
      common(weighing, chassis, rows, comparison.P),
      sums(given) {}

Contradiction ParityWindows::Rigid::next(bool with_errors) {
  const Chassis& chassis = comparison.chassis;
  const Increment& sum = sums.windows[window];
  RowVector variance = rounding;
  for (; part < sums.parts_end[window]; ++part) {
    const Increment& travel = sums.parts[part];
    variance += noise_of(chassis, rows, estimated_motion(chassis, rows, travel), travel.duration_s);
  }
  ++window;
  const Twist2 motion = estimate_twist(rows, {readings_of(chassis, rows, sum).z, variance}).twist;
  return contradiction_of(comparison, sum, motion.vector(), variance, with_errors);
}

ParityWindows::ParityWindows(const Run& run, const Chassis& chassis, const Chassis& weighing,
                             std::span<const Parameter> parameters, double window_s, const WindowSums* sums,
                             bool with_errors)
    : run_(run), chassis_(chassis), window_s_(window_s), with_errors_(with_errors), gauge_(chassis) {
  if (is_steered(chassis)) {
    if (rows_of(chassis, chassis.gyro.has_value()).count() > 3)
      steered_.emplace(chassis, weighing, parameters, with_errors);
    return;
  }
  if (!sums && (own_sums_ = window_sums(run, chassis, window_s))) sums = &*own_sums_;
  if (sums) rigid_.emplace(chassis, weighing, parameters, *sums);
}

std::optional<Contradiction> ParityWindows::take(const Rolling* before) {
  const std::size_t index = taken_++;
  within_ = false;
  if (steered_) return take_steered(index, before);
  return rigid_ ? take_rigid(index, before) : std::nullopt;
}

std::optional<Contradiction> ParityWindows::take_rigid(std::size_t index, const Rolling* before) {
  const auto& [first, last] = std::tie(rigid_->sums.first, rigid_->sums.last);
  if (rigid_->window == last.size() || index < first[rigid_->window]) return std::nullopt;
  within_ = is_whole(run_, index, chassis_);  // else it only ends the window
  if (within_ && before) rigid_->add(run_.readings.increments[index], *before);
  return index == last[rigid_->window] ? std::optional(rigid_->next(with_errors_)) : std::nullopt;
}

void ParityWindows::Rigid::add(const Increment& increment, Rolling before) {
  octave = before.octave;
  duration_s += increment.duration_s;
  const Rolled own = common.rolled(before, increment);
  std::ranges::transform(rolled, own, rolled.begin(), std::plus());
}

std::optional<Contradiction> ParityWindows::take_steered(std::size_t index, const Rolling* before) {
  within_ = is_whole(run_, index, chassis_) && steered_->take(run_.readings.increments[index]);
  if (within_ && before) {
    // As SteeredModel: without a gyro one set of weights serves all speeds.
    const CommonError own = steered_->common_error(gauge_.octave_speed(chassis_.gyro ? before->octave : 0));
    if (steered_common_.cols() == 0) steered_common_.setZero(3, own.cols());
    steered_common_ += own;
  }
  if (within_ && !is_full(steered_->duration_s(), window_s_)) return std::nullopt;
  const bool kept = is_kept(steered_->duration_s(), window_s_);
  std::optional<Contradiction> sum = steered_->close();
  return kept ? sum : std::nullopt;
}

CommonError ParityWindows::take_common_error() {
  const CommonError common =
      steered_ ? steered_common_ : rigid_->common.of(rigid_->duration_s, rigid_->rolled, rigid_->octave);
  drop_common_error();
  return common;
}

void ParityWindows::drop_common_error() {
  steered_common_.resize(Eigen::NoChange, 0);
  if (!rigid_) return;
  rigid_->rolled = {};
  rigid_->duration_s = 0.0;
}

}  // namespace trundle::calibration
