#pragma once

#include <boost/math/distributions/binomial.hpp>
#include <gtest/gtest.h>

#include "trundle/calibration/result.hpp"

namespace trundle::test {

/// That parameter alone, within four of its sigmas, on so many runs.
inline void expect_offered(const calibration::CalibrationResult& result, const chassis::Parameter& parameter,
                           double truth, std::size_t runs) {
  ASSERT_EQ(result.offers.size(), 1U);
  const calibration::ParameterOffer& offer = result.offers.front();
  EXPECT_EQ(offer.parameter, parameter);
  EXPECT_NEAR(offer.value, truth, 4.0 * offer.sigma);
  EXPECT_EQ(offer.parts, runs);
  EXPECT_FALSE(offer.of_halves);
}

/// Of so many calibrations of robots that do not have it, by the level; as rare as 3σ.
inline double most_offered_by_chance(int calibrations) {
  const boost::math::binomial chance(calibrations, calibration::ParameterOffer::kLevel);
  return quantile(complement(chance, 0.00135));
}

}  // namespace trundle::test
