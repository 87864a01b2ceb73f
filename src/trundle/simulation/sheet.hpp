#pragma once

#include <string>
#include <vector>

#include "trundle/simulation/scenario.hpp"

namespace trundle::simulation {

/// Square runs measured by hand (UMBmark).
struct SheetPlan {
  double side_m = 2.0;
  int runs = 5;  ///< in each turning sense
  Pace pace = {};
  bool with_leg = true;           ///< the chord of the first leg was measured
  double position_sigma_m = 0.0;  ///< of the measuring tape, of x and of y
  double heading_sigma_rad = 0.0;
  double leg_sigma_m = 0.0;
};

/// One row: measured end pose minus the odometry's.
struct SheetRow {
  TurnSense turn = TurnSense::cw;
  double x_m = 0.0;
  double y_m = 0.0;
  double heading_rad = 0.0;
  double leg_m = kNotMeasured;
};

/// Drives the squares, clockwise first, with the robots of the scenario, steering by odometry without
/// quantisation.
std::vector<SheetRow> simulate_sheet(const Scenario& scenario, const SheetPlan& plan);

/// The sheet as interfaces and docs describe it: turn,x_m,y_m,heading_deg[,leg_m], the side in a comment.
std::string to_csv(const std::vector<SheetRow>& rows, double side_m);

}  // namespace trundle::simulation
