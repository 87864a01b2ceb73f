#include "trundle/simulation/sheet.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace trundle::simulation {
namespace {

SheetRow measured_row(const Scenario& scenario, const SheetPlan& plan, TurnSense turn) {
  const Trajectory truth = simulate(scenario).truth.body;
  const Pose2 end = truth.poses.back().pose;
  const Pose2 odometry_end = end_of(scenario.path);
  Random random(scenario.seed, 100);
  SheetRow row{.turn = turn};
  row.x_m = end.x - odometry_end.x + random.normal(plan.position_sigma_m);
  row.y_m = end.y - odometry_end.y + random.normal(plan.position_sigma_m);
  row.heading_rad = end.heading - odometry_end.heading + random.normal(plan.heading_sigma_rad);
  if (!plan.with_leg) return row;
  // Steered wheels take a ramp more to come to rest.
  const double leg_end_s =
      in_whole_intervals(scenario.path, scenario.encoders.rate_hz).front().duration_s + plan.pace.rest_s;
  const auto corner = pose_at(truth, leg_end_s, leg_end_s);
  row.leg_m = corner->translation().norm() + random.normal(plan.leg_sigma_m);
  return row;
}

}  // namespace

std::vector<SheetRow> simulate_sheet(const Scenario& scenario, const SheetPlan& plan) {
  Scenario run = scenario;
  run.start = {};
  run.start_s = 0.0;
  run.steering = Steering::odometry;
  run.whole_intervals = true;
  run.encoders.quantised = false;
  std::vector<SheetRow> rows;
  for (const TurnSense turn : {TurnSense::cw, TurnSense::ccw}) {
    run.path = square(plan.side_m, turn, plan.pace);
    for (int i = 0; i < plan.runs; ++i) {
      run.seed = Random(scenario.seed, 1 + rows.size()).bits();
      rows.push_back(measured_row(run, plan, turn));
    }
  }
  return rows;
}

std::string to_csv(const std::vector<SheetRow>& rows, double side_m) {
  const bool with_leg = std::ranges::none_of(rows, [](const SheetRow& r) { return std::isnan(r.leg_m); });
  std::string text =
      fmt::format("# side_m = {}\nturn,x_m,y_m,heading_deg{}\n", side_m, with_leg ? ",leg_m" : "");
  for (const SheetRow& row : rows) {
    text += fmt::format("{},{:.6f},{:.6f},{:.6f}", row.turn == TurnSense::cw ? "cw" : "ccw", row.x_m, row.y_m,
                        degrees(row.heading_rad));
    text += with_leg ? fmt::format(",{:.6f}\n", row.leg_m) : "\n";
  }
  return text;
}

}  // namespace trundle::simulation
