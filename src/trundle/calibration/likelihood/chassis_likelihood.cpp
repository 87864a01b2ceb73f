#include "trundle/calibration/likelihood/chassis_likelihood.hpp"

#include <optional>

#include "trundle/calibration/likelihood/contradiction.hpp"
#include "trundle/calibration/likelihood/steered_window.hpp"
#include "trundle/geometry/decompositions.hpp"

namespace trundle::calibration {
namespace {

void add_to(Information& information, const Contradiction& window, const ChassisLikelihoodOptions& options) {
  add_within(information, window.J, inverse_of((options.variance_factor * window.S).eval()), window.y,
             options.gate);
}

std::vector<Information> steered_likelihood(const Run& run, const Chassis& chassis,
                                            std::span<const Parameter> parameters,
                                            const ChassisLikelihoodOptions& options) {
  const auto n = static_cast<Eigen::Index>(parameters.size());
  std::vector<Information> result(static_cast<std::size_t>(options.blocks), Information::zero(n));
  const bool with_gyro = chassis.gyro.has_value();
  if (rows_of(chassis, with_gyro).count() <= 3) return result;
  const auto& increments = run.readings.increments;
  SteeredWindow window(chassis, parameters);
  for (std::size_t i = 0; i < increments.size(); ++i) {
    const bool whole = !run.readings.bridged[i] && (increments[i].has_gyro || !with_gyro);
    const bool goes_on = whole && window.take(increments[i]);
    if (goes_on && !is_full(window.duration_s(), options.window_s)) continue;
    const bool kept = is_kept(window.duration_s(), options.window_s);
    if (const auto sum = window.close(); sum && kept)
      add_to(result[i * result.size() / increments.size()], *sum, options);
  }
  return result;
}

}  // namespace

std::vector<Information> chassis_likelihood(const Run& run, const Robot& robot,
                                            std::span<const Parameter> parameters,
                                            const ChassisLikelihoodOptions& options) {
  const Chassis& chassis = robot.chassis;
  if (is_steered(chassis)) return steered_likelihood(run, chassis, parameters, options);
  const auto n = static_cast<Eigen::Index>(parameters.size());
  std::vector<Information> result(static_cast<std::size_t>(options.blocks), Information::zero(n));
  const std::optional<WindowSums> own =
      options.sums ? std::nullopt : window_sums(run, chassis, options.window_s);
  const WindowSums* sums = options.sums ? options.sums : own ? &*own : nullptr;
  if (!sums) return result;
  const Rows rows = rows_of(chassis, chassis.gyro.has_value());
  const Comparison comparison =
      comparison_of(chassis, rows, chassis, rows, left_null_space(rows), parameters);
  const RowVector rounding = rounding_of(chassis, rows);
  std::size_t part = 0;
  for (std::size_t i = 0; i < sums->windows.size(); ++i) {
    const Increment& sum = sums->windows[i];
    RowVector variance = rounding;
    for (; part < sums->parts_end[i]; ++part) {
      const Increment& travel = sums->parts[part];
      variance += noise_of(chassis, rows, estimated_motion(chassis, rows, travel), travel.duration_s);
    }
    const Twist2 motion = estimate_twist(rows, {readings_of(chassis, rows, sum).z, variance}).twist;
    add_to(result[sums->last[i] * result.size() / sums->increments],
           contradiction_of(comparison, sum, motion.vector(), variance), options);
  }
  return result;
}

}  // namespace trundle::calibration
