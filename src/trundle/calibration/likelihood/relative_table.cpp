#include "trundle/calibration/likelihood/relative_table.hpp"

#include <algorithm>
#include <cmath>

#include "trundle/geometry/decompositions.hpp"

namespace trundle::calibration {
namespace {

/// Index of the increment that spans these times alone, or that there is none.
struct Cover {
  bool covered = false;  ///< the readings reach from start to end
  std::optional<std::size_t> increment;
};

Cover cover_of(const AlignedReadings& readings, double start_s, double end_s) {
  const auto& increments = readings.increments;
  const double tolerance = 1e-9 * std::max(1.0, std::abs(end_s));
  if (increments.empty() || start_s < readings.start_s - tolerance ||
      end_s > increments.back().time_s + tolerance)
    return {};
  const auto first = std::ranges::upper_bound(increments, start_s + tolerance, {}, &Increment::time_s);
  if (first == increments.end() || (*first).time_s < end_s - tolerance) return {true, std::nullopt};
  return {true, static_cast<std::size_t>(first - increments.begin())};
}

void append(RelativeTable& table, std::size_t wheels, const Increment& increment,
            const RelativeMotion& motion) {
  const double share = (motion.end_s - motion.start_s) / increment.duration_s;
  for (std::size_t k = 0; k < wheels; ++k) table.input[k].push_back(share * increment.turned[k]);
  if (table.with_duration) {
    table.input[wheels].push_back(share * increment.gyro_rad);
    table.input[wheels + 1].push_back(share * increment.duration_s);
  }
  table.motion[0].push_back(motion.motion.x);
  table.motion[1].push_back(motion.motion.y);
  table.motion[2].push_back(motion.motion.heading);
}

std::size_t inputs_without_gyro(const Chassis& chassis) {
  return chassis.wheel_count > 0 ? chassis.wheels().size() : 2;
}

RelativeColumns columns_between(const RelativeTable& table, std::size_t first, std::size_t last) {
  const auto part = [&](const std::vector<double>& column) {
    return column.empty() ? std::span<const double>{} : std::span(column).subspan(first, last - first);
  };
  RelativeColumns columns{.input = {},
                          .x_m = part(table.motion[0]),
                          .y_m = part(table.motion[1]),
                          .heading_rad = part(table.motion[2])};
  for (std::size_t k = 0; k < kMaxInputs; ++k) columns.input[k] = part(table.input[k]);
  return columns;
}

/// accumulate_relative puts the sensor's pose behind the chassis parameters: column j of S says which of its
/// unknowns are parameter j.
Eigen::MatrixXd selection(std::span<const Parameter> parameters) {
  const auto n = static_cast<Eigen::Index>(parameters.size());
  Eigen::MatrixXd S = Eigen::MatrixXd::Zero(n + 3, n);
  S.topRows(n).setIdentity();
  constexpr std::array kSensor = {ParameterKind::reference_x, ParameterKind::reference_y,
                                  ParameterKind::reference_heading};
  for (Eigen::Index j = 0; j < n; ++j)
    for (std::size_t i = 0; i < kSensor.size(); ++i)
      if (parameters[static_cast<std::size_t>(j)].kind == kSensor[i])
        S(n + static_cast<Eigen::Index>(i), j) = 1.0;
  return S;
}

}  // namespace

std::optional<RelativeTable> relative_table(const Run& run, const Robot& robot) {
  if (run.relative_motions.empty() || run.readings.increments.empty()) return std::nullopt;
  RelativeTable table;
  table.with_gyro = robot.chassis.gyro.has_value() && run.readings.increments.front().has_gyro;
  table.with_duration = table.with_gyro || robot.chassis.wheel_count == 0;
  if (!MotionModel(robot.chassis, {}, table.with_gyro).square()) return std::nullopt;
  const std::size_t wheels = inputs_without_gyro(robot.chassis);
  for (const RelativeMotion& motion : run.relative_motions) {
    const double offset = robot.reference_time_offset_s;
    const Cover cover = cover_of(run.readings, motion.start_s + offset, motion.end_s + offset);
    if (!cover.covered) continue;
    if (!cover.increment) return std::nullopt;
    const Increment& increment = run.readings.increments[*cover.increment];
    if (robot.chassis.gyro && increment.has_gyro != table.with_gyro) return std::nullopt;
    append(table, wheels, increment, motion);
  }
  return table;
}

std::vector<Information> relative_information(const RelativeTable& table, const Robot& robot,
                                              std::span<const Parameter> parameters,
                                              const RelativeWeights& weights, std::size_t blocks) {
  const MotionModel model(robot.chassis, parameters, table.with_gyro);
  const Eigen::MatrixXd S = selection(parameters);
  std::vector<Information> result;
  for (std::size_t block = 0; block < blocks; ++block) {
    const RelativeColumns columns =
        columns_between(table, block * table.rows() / blocks, (block + 1) * table.rows() / blocks);
    const RelativeNormalEquations sums =
        accumulate_relative(columns, model.linearised(), robot.body_from_reference, weights);
    result.push_back({congruent(sums.information, S), S.transpose() * sums.gradient, sums.cost,
                      static_cast<int>(3 * (columns.rows() - sums.outliers))});
  }
  return result;
}

}  // namespace trundle::calibration
