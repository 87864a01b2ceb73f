#pragma once

#include <span>
#include <vector>

#include "trundle/slip/detector.hpp"

namespace trundle::slip {

/// How to learn.
struct LearnOptions {
  double probability = 0.01;  ///< for which the limit is wanted
  double significance = 0.1;  ///< of the normality test
};

/// What was learned, and whether the residuals are as normal as the method takes them to be.
struct LearnedResiduals {
  ResidualModel model;
  std::vector<double>
      sample;               ///< residuals in units of their sigma, all degrees of freedom one after the other
  NormalityTest normality;  ///< of the degree of freedom that is least normal
};

/// The mean (from the geometry) and the covariance of what the rows contradict each other by in moving
/// intervals: docs/theory/slip-detection.md, eq. 12 and 13. Throws CannotAnswer where there are too few.
LearnedResiduals learn_residuals(std::span<const JudgedInterval> clean, const Robot& robot,
                                 const LearnOptions& options);

/// δ in the intervals of nearly straight driving, and the band that follows: docs/theory/slip-published.md,
/// eq. 1 and 4.
struct LearnedBand {
  Band band;
  std::vector<double> sample;  ///< δ [rad]
};
LearnedBand learn_band(std::span<const JudgedInterval> clean, const Robot& robot,
                       const LearnOptions& options);

}  // namespace trundle::slip
