#include "trundle/calibration/validation/influence.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "calibration/simulated_runs.hpp"

namespace trundle::calibration {
namespace {

class InfluenceOfRuns : public testing::Test {
 protected:
  InfluenceOfRuns() {
    for (const std::uint64_t seed : {1, 2, 3})
      for (trundle::calibration::Run& run :
           test::prepared(nominal_, test::true_differential(), test::differential_paths(), seed))
        runs_.push_back(std::move(run));
    estimate_ = estimate_parameters({runs_, nominal_, parameters_});
    influence_ = influence_of(estimate_, nominal_, parameters_);
  }

  Eigen::VectorXd values(const Robot& robot) const {
    Eigen::VectorXd values(3);
    for (std::size_t j = 0; j < 3; ++j)
      values[static_cast<Eigen::Index>(j)] = value_of(parameters_[j], robot);
    return values;
  }
  /// In its standard deviations.
  double distance(const Eigen::VectorXd& a, const Eigen::VectorXd& b) const {
    return ((a - b).array() / estimate_.covariance.diagonal().array().sqrt()).abs().maxCoeff();
  }

  const Robot nominal_ = test::nominal_differential();
  const std::vector<Parameter> parameters_ = {
      {ParameterKind::diameter, 0}, {ParameterKind::diameter, 1}, {ParameterKind::track, -1}};
  std::vector<trundle::calibration::Run> runs_;
  Estimate estimate_;
  Influence influence_;
};

TEST_F(InfluenceOfRuns, AllRunsGiveTheEstimate) {
  EXPECT_LT(distance(influence_.after.back(), values(estimate_.robot)), 0.05);
  const Eigen::VectorXd sigma = estimate_.covariance.diagonal().cwiseSqrt();
  EXPECT_LT(((influence_.sigma_after.back() - sigma).array() / sigma.array()).abs().maxCoeff(), 0.02);
}

/// Another fit without the run is the oracle. It measures its noise anew, so it may differ by a part of σ.
TEST_F(InfluenceOfRuns, LeavingARunOutIsWhatAnotherFitFinds) {
  for (const std::size_t left_out : {std::size_t{0}, std::size_t{2}, runs_.size() - 1}) {
    std::vector<trundle::calibration::Run> others = runs_;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(left_out));
    const Eigen::VectorXd refit = values(estimate_parameters({others, nominal_, parameters_}).robot);
    EXPECT_LT(distance(influence_.without[left_out], refit), 0.3) << left_out;
  }
}

/// Another fit of the others alone, without the run, is the oracle.
TEST_F(InfluenceOfRuns, HoldingAParameterTakesTheOthersWhereAnotherFitOfThemFindsThem) {
  constexpr std::size_t kLeftOut = 2;
  std::vector<trundle::calibration::Run> others = runs_;
  others.erase(others.begin() + kLeftOut);
  for (std::size_t held = 0; held < parameters_.size(); ++held) {
    const auto row = static_cast<Eigen::Index>(held);
    const double value = values(estimate_.robot)[row] + 3.0 * std::sqrt(estimate_.covariance(row, row));
    Robot given = nominal_;
    set_value(parameters_[held], value, given);
    std::vector<Parameter> free = parameters_;
    free.erase(free.begin() + row);
    const Eigen::VectorXd refit = values(estimate_parameters({others, given, free}).robot);
    const Eigen::VectorXd moved = without_holding(held, value, influence_)[kLeftOut];
    EXPECT_DOUBLE_EQ(moved[row], value);
    EXPECT_LT(distance(moved, refit), 0.3) << held;
    EXPECT_GT(distance(influence_.without[kLeftOut], refit), 1.0) << held;
  }
}

TEST_F(InfluenceOfRuns, EachFurtherRunMakesItSurer) {
  for (std::size_t i = 1; i < runs_.size(); ++i)
    EXPECT_TRUE(
        (influence_.sigma_after[i].array() <= influence_.sigma_after[i - 1].array() * (1.0 + 1e-9)).all())
        << i;
}

}  // namespace
}  // namespace trundle::calibration
