#include "trundle/slip/learn.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>
#include <fmt/format.h>

#include "trundle/geometry/decompositions.hpp"
#include "trundle/io/error.hpp"
#include "trundle/statistics/distribution.hpp"
#include "trundle/statistics/median.hpp"

namespace trundle::slip {
namespace {

// How wrong a robot file's geometry is taken to be, so that a motion that clean driving lacks is not learned
// from noise.
constexpr double kGeometryPrior = 0.05;
constexpr int kMotions = 3;  // dx, dy, dθ: coefficients that are fitted for each residual
// Intervals beyond those: they show a scale within 1/√16 = 25 %, 1σ.
constexpr std::size_t kLeastSpare = 8;
// Timing noise that is looked for.
constexpr double kLeastTiming_s = 0.001;
constexpr double kGreatestTiming_s = 0.1;  // a whole step of a log at 10 Hz
constexpr double kTimingStep = 1.25;       // from one to the next: as well as kLeastSpare intervals show it
constexpr double kClearlyLikelier = 10.8;  // gain in −2 log likelihood: χ² of one parameter, 1e-3 by chance

bool is_moving(const JudgedInterval& interval, const Parity& parity) {
  if (parity.uses_gyro() && !interval.readings.has_gyro) return false;
  const auto& turned = interval.readings.turned;
  return std::any_of(turned.begin(), turned.begin() + static_cast<std::ptrdiff_t>(parity.wheels()),
                     [](double t) { return t != 0.0; });
}

/// Weighted regression of y on the twist, held at zero by the prior where the twist was never excited.
MotionToParity regression(std::span<const Parity::Raw> raws, const Parity& parity) {
  const int d = parity.degrees_of_freedom();
  Matrix3 normal = Matrix3::Zero();
  MotionToParity right = MotionToParity::Zero(d, 3);
  double scale = 0.0;
  for (const Parity::Raw& raw : raws) {
    const double weight = d / raw.covariance.trace();
    scale += raw.y.squaredNorm() * weight / (d * static_cast<double>(raws.size()));
    normal += weight * raw.twist * raw.twist.transpose();
    right += weight * raw.y * raw.twist.transpose();
  }
  const Vector3 prior = kGeometryPrior * parity.size();
  normal.diagonal() += scale * prior.cwiseAbs2().cwiseInverse();
  return divide_ldlt(right, normal);
}

std::vector<ParityVector> whitened(std::span<const Parity::Raw> raws, const ResidualModel& model) {
  std::vector<ParityVector> result;
  for (const Parity::Raw& raw : raws) {
    ParityVector e = raw.y - model.by_motion * raw.twist;
    const Eigen::LLT<ParityMatrix> cholesky(raw.covariance);
    cholesky.matrixL().solveInPlace(e);
    if (model.scale.size() > 0) model.scale.triangularView<Eigen::Lower>().solveInPlace(e);
    result.push_back(e);
  }
  return result;
}

ParityMatrix scale_of(std::span<const ParityVector> residuals) {
  const Eigen::Index d = residuals.front().size();
  ParityMatrix covariance = ParityMatrix::Zero(d, d);
  for (const ParityVector& e : residuals) covariance += e * e.transpose();
  covariance /= static_cast<double>(residuals.size() - kMotions);
  covariance.diagonal().array() += 1e-12 * covariance.trace() + 1e-300;
  return covariance.llt().matrixL();
}

std::vector<double> component(std::span<const ParityVector> residuals, Eigen::Index k) {
  std::vector<double> sample;
  for (const ParityVector& e : residuals) sample.push_back(e[k]);
  return sample;
}

/// Hotelling's T² of the next interval, with the mean number of parameters that its motion draws upon.
double hotelling_limit(double probability, double dof, double n) {
  const double rest = n - kMotions;
  return dof * rest / (rest - dof + 1.0) * f_limit(probability, dof, rest - dof + 1.0) * (1.0 + kMotions / n);
}

void learn_limit(std::span<const ParityVector> residuals, const LearnOptions& options, ResidualModel& model) {
  if (!model.empirical) {
    model.limit = hotelling_limit(options.probability, static_cast<double>(residuals.front().size()),
                                  static_cast<double>(residuals.size()));
    return;
  }
  std::vector<double> chi2;
  for (const ParityVector& e : residuals) chi2.push_back(e.squaredNorm());
  std::ranges::sort(chi2);
  model.limit = upper_quantile(chi2, options.probability, model.beyond_sample);
}

/// The largest value that a cumulative sum reaches where nothing slips.
double largest_sum(std::span<const JudgedInterval> clean, const Parity& parity, const ResidualModel& model) {
  std::array<std::array<Cusum, 2>, kMaxFaults> sums{};
  double largest = 0.0;
  for (const JudgedInterval& interval : clean) {
    if (!is_moving(interval, parity)) {
      sums = {};
      continue;
    }
    const Contradiction c = parity.contradiction(interval, &model);
    if (c.chi2 > model.limit) continue;
    for (std::size_t i = 0; i < parity.faults().size(); ++i)
      for (const int side : {0, 1})
        largest = std::max(largest, sums[i][static_cast<std::size_t>(side)].step(
                                        side == 0 ? c.score[i] : -c.score[i], kCusumAllowance));
  }
  return largest;
}

std::vector<JudgedInterval> moving_intervals(std::span<const JudgedInterval> clean, const Parity& parity) {
  std::vector<JudgedInterval> moving;
  for (const JudgedInterval& interval : clean)
    if (is_moving(interval, parity)) moving.push_back(interval);
  return moving;
}

/// A model without limits, and how well it fits.
struct Fit {
  ResidualModel model;
  std::vector<ParityVector> residuals;
  double deviance = 0.0;  ///< −2 log likelihood, but for a constant
};

Fit fit_with(double timing_sigma_s, std::span<const JudgedInterval> moving, const Parity& parity) {
  Fit fit;
  std::vector<Parity::Raw> raws;
  std::vector<double> durations;
  for (const JudgedInterval& interval : moving) {
    raws.push_back(parity.raw(interval, timing_sigma_s));
    durations.push_back(interval.readings.duration_s);
    fit.deviance += std::log(raws.back().covariance.determinant());
  }
  fit.model.timing_sigma_s = timing_sigma_s;
  fit.model.samples = raws.size();
  fit.model.interval_s = median(durations);
  fit.model.by_motion = regression(raws, parity);
  fit.model.scale = scale_of(whitened(raws, fit.model));
  fit.deviance += 2.0 * static_cast<double>(raws.size()) * fit.model.scale.diagonal().array().log().sum();
  fit.residuals = whitened(raws, fit.model);
  return fit;
}

/// Stamps that tremble show where the turn rate changes within an interval. They are believed to where that
/// makes the sample clearly likelier.
Fit best_fit(std::span<const JudgedInterval> moving, const Parity& parity) {
  Fit best = fit_with(0.0, moving, parity);
  const double without = best.deviance - kClearlyLikelier;
  for (double sigma_s = kLeastTiming_s; sigma_s <= kGreatestTiming_s; sigma_s *= kTimingStep) {
    Fit fit = fit_with(sigma_s, moving, parity);
    if (fit.deviance < std::min(without, best.deviance)) best = std::move(fit);
  }
  return best;
}

}  // namespace

LearnedResiduals learn_residuals(std::span<const JudgedInterval> clean, const Robot& robot,
                                 const LearnOptions& options) {
  const Parity parity(robot);
  const std::vector<JudgedInterval> moving = moving_intervals(clean, parity);
  const auto d = static_cast<std::size_t>(parity.degrees_of_freedom());
  if (moving.size() < kMotions + d + kLeastSpare)
    throw CannotAnswer(fmt::format("only {} moving intervals to learn from: at least {} are needed",
                                   moving.size(), kMotions + d + kLeastSpare));
  Fit fit = best_fit(moving, parity);
  LearnedResiduals learned;
  learned.model = fit.model;
  for (Eigen::Index k = 0; k < static_cast<Eigen::Index>(d); ++k) {
    const std::vector<double> sample = component(fit.residuals, k);
    // One of d tests, so that all together have the significance that was asked for.
    const NormalityTest test =
        test_normality(moments_of(sample), options.significance / static_cast<double>(d));
    const auto worst = [](const NormalityTest& t) { return std::max(std::abs(t.u1), std::abs(t.u2)); };
    if (k == 0 || worst(test) > worst(learned.normality)) learned.normality = test;
    learned.sample.insert(learned.sample.end(), sample.begin(), sample.end());
  }
  learned.model.empirical = learned.normality.rejected;
  learn_limit(fit.residuals, options, learned.model);
  learned.model.persistent_limit = largest_sum(clean, parity, learned.model);
  return learned;
}

LearnedBand learn_band(std::span<const JudgedInterval> clean, const Robot& robot,
                       const LearnOptions& options) {
  const SlipDetector detector(robot, {.method = SlipMethod::published, .probability = options.probability});
  LearnedBand learned;
  std::vector<double> durations;
  double least = std::numeric_limits<double>::infinity();
  double greatest = 0.0;
  for (const JudgedInterval& interval : clean) {
    if (detector.status_of(interval.readings) != SlipStatus::judged) continue;
    const Contradiction c = detector.parity().contradiction(interval, nullptr);
    learned.sample.push_back(detector.delta(c));
    durations.push_back(interval.readings.duration_s);
    const double speed = std::abs(0.5 * (c.travel[0] + c.travel[1])) / interval.readings.duration_s;
    least = std::min(least, speed);
    greatest = std::max(greatest, speed);
  }
  learned.band = learn_band(learned.sample, options.probability, options.significance);
  learned.band.interval_s = median(durations);
  learned.band.least_speed_m_s = least;
  learned.band.greatest_speed_m_s = greatest;
  return learned;
}

}  // namespace trundle::slip
