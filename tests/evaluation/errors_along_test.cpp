#include "trundle/evaluation/errors_along.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace trundle::evaluation {
namespace {

/// 10 m along x; the estimate drifts sideways by 1 cm for each metre, and says so.
struct Drifting {
  Trajectory reference, estimate;
  Drifting() {
    for (int i = 0; i <= 100; ++i) {
      const double x = 0.1 * i;
      reference.poses.push_back({1.0 * i, {x, 0.0, 0.0}});
      estimate.poses.push_back({1.0 * i, {x, 0.01 * x, 0.002 * x}});
      const double sigma_m = 0.01 * x, sigma_rad = 0.002 * x;
      estimate.covariances.push_back(
          Vector3(1e-12 + sigma_m * sigma_m, 1e-12 + sigma_m * sigma_m, 1e-12 + sigma_rad * sigma_rad)
              .asDiagonal());
    }
  }
};

TEST(ErrorsAlong, AreWhatEvaluateSumsUp) {
  const Drifting run;
  const ErrorsAlong errors = errors_along(run.estimate, run.reference);
  const Evaluation sum = evaluate(run.estimate, run.reference);
  double squares = 0.0;
  for (const ErrorAt& at : errors.at) squares += at.position_m * at.position_m;
  EXPECT_EQ(errors.at.size(), sum.compared);
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(errors.at.size())), sum.position_m.rms, 1e-12);
  EXPECT_EQ(errors.degrees_of_freedom, 3);
  EXPECT_NEAR(errors.at.back().position_m, sum.final_position_m, 1e-12);
}

TEST(ErrorsAlong, BoundsAreThoseOfTheCovariance) {
  const Drifting run;
  const ErrorAt last = errors_along(run.estimate, run.reference).at.back();
  EXPECT_NEAR(last.way_m, 10.0, 0.05);
  EXPECT_NEAR(last.position_m, 0.1, 1e-12);
  EXPECT_NEAR(last.bound95_m, std::sqrt(5.991464547107979) * 0.1, 1e-6);
  EXPECT_NEAR(last.heading_rad, 0.02, 1e-12);
  EXPECT_NEAR(last.heading95_rad, 1.959963984540054 * 0.02, 1e-6);
  EXPECT_NEAR(last.nees, 2.0, 1e-3);  // one σ sideways, one σ in heading
}

}  // namespace
}  // namespace trundle::evaluation
