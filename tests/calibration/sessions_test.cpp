// Of few sessions the spread itself is not well known: what is said of a further one must hold all the same.
#include "trundle/calibration/validation/sessions.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "trundle/statistics/random.hpp"

#include "calibration/simulated_runs.hpp"

namespace trundle::calibration {
namespace {

using namespace test;

constexpr Parameter kTheTrack = {ParameterKind::track, -1};

/// What sessions without any noise gave, of which each has a track of its own.
class SessionsOfOwnTracks {
 public:
  explicit SessionsOfOwnTracks(int sessions) {
    estimate_.robot = nominal_differential();
    estimate_.covariance = Eigen::MatrixXd::Zero(1, 1);
    estimate_.space.scale = Eigen::VectorXd::Ones(1);
    estimate_.space.basis = Eigen::MatrixXd::Identity(1, 1);
    estimates_.assign(static_cast<std::size_t>(sessions), estimate_);
  }
  SessionSpread draw(Random& random) {
    mean_m = 0.0;
    for (Estimate& estimate : estimates_) {
      const double track_m = kTrack_m + random.normal(kSpread_m);
      set_value(kTheTrack, track_m, estimate.robot);
      mean_m += track_m / static_cast<double>(estimates_.size());
    }
    return spread_of(estimates_, std::vector{kTheTrack}, estimate_.space);
  }

  static constexpr double kTrack_m = 0.4, kSpread_m = 0.001;
  double mean_m = 0.0;

 private:
  Estimate estimate_;
  std::vector<Estimate> estimates_;
};

TEST(SessionSpread, AFurtherSessionIsWithinOneSigmaIn68Percent) {
  constexpr int kDraws = 4000;
  constexpr double kWithin = 0.682689;
  const double chance = 4.0 * std::sqrt(kWithin * (1.0 - kWithin) / kDraws);
  for (const int sessions : {2, 3, 5, 8}) {
    Random random(17, static_cast<std::uint64_t>(sessions));
    SessionsOfOwnTracks drawn(sessions);
    int within = 0;
    for (int draw = 0; draw < kDraws; ++draw) {
      const double sigma_m = std::sqrt(drawn.draw(random).of_a_further_session()(0, 0));
      const double further_m = SessionsOfOwnTracks::kTrack_m + random.normal(SessionsOfOwnTracks::kSpread_m);
      within += std::abs(further_m - drawn.mean_m) < sigma_m ? 1 : 0;
    }
    EXPECT_NEAR(within / double{kDraws}, kWithin, chance) << sessions << " sessions";
  }
}

}  // namespace
}  // namespace trundle::calibration
