#include "trundle/simulation/sheet.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "robots.hpp"

namespace trundle::simulation {
namespace {

using test::exact_scenario;
using test::quiet_differential;

TEST(Sheet, WithoutNoiseShowsTheExactEffects) {
  const Robot truth = quiet_differential(0.1503, 0.1497, 0.51);
  const auto rows =
      simulate_sheet(exact_scenario(quiet_differential(), truth, {}), {.side_m = 2.0, .runs = 2});
  ASSERT_EQ(rows.size(), 4u);
  double e_max = 0.0;
  const double beta = 2.0 * (0.1497 - 0.1503) / (0.15 * 0.51);
  const double alpha = 0.5 * kPi * (1.0 - 0.50 / 0.51);
  for (const SheetRow& row : rows) {
    e_max = std::max(e_max, std::hypot(row.x_m, row.y_m));
    const double sign = row.turn == TurnSense::cw ? 1.0 : -1.0;
    EXPECT_NEAR(row.heading_rad, 4.0 * (sign * alpha + beta), 1e-12);
    EXPECT_NEAR(row.leg_m, 2.0 * std::sin(0.5 * beta) / (0.5 * beta), 1e-12);
  }
  EXPECT_NEAR(e_max, 0.2688, 0.5e-4);
}

TEST(Sheet, MeasuringErrorsDifferFromRowToRow) {
  const auto rows = simulate_sheet(exact_scenario(quiet_differential(), quiet_differential(), {}),
                                   {.runs = 200, .position_sigma_m = 0.002, .leg_sigma_m = 0.001});
  double x2 = 0.0, leg2 = 0.0;
  for (const SheetRow& row : rows)
    x2 += row.x_m * row.x_m / 400.0, leg2 += std::pow(row.leg_m - 2.0, 2) / 400.0;
  EXPECT_NEAR(x2 / 4e-6, 1.0, 4.0 * std::sqrt(2.0 / 400.0));
  EXPECT_NEAR(leg2 / 1e-6, 1.0, 4.0 * std::sqrt(2.0 / 400.0));
}

TEST(Sheet, ColumnsAreThoseOfTheFormat) {
  const std::vector<SheetRow> rows = {{TurnSense::cw, 0.1, -0.2, kPi, 2.0},
                                      {TurnSense::ccw, 0.0, 0.0, 0.0, 1.99}};
  EXPECT_EQ(to_csv(rows, 2.0),
            "# side_m = 2\nturn,x_m,y_m,heading_deg,leg_m\n"
            "cw,0.100000,-0.200000,180.000000,2.000000\nccw,0.000000,0.000000,0.000000,1.990000\n");
  EXPECT_THAT(to_csv({{TurnSense::cw, 0.1, -0.2, 0.0}}, 2.0), testing::HasSubstr("heading_deg\ncw"));
}

}  // namespace
}  // namespace trundle::simulation
