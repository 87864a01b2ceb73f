#include "trundle/slip/evidence.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "trundle/geometry/squared.hpp"
#include "trundle/slip/uneven_wheel.hpp"

namespace trundle::slip {
namespace {

// A wheel is named when its posterior probability reaches this and what remains is within its limit.
constexpr double kCertain = 0.9;
constexpr double kRestSigmas = 3.72;  // one-sided 1e-4

/// The limit that χ² exceeds by chance with 1e-4 [Wilson & Hilferty 1931].
double rest_limit(double dof) {
  if (dof <= 0.0) return 0.0;
  const double a = 2.0 / (9.0 * dof);
  const double root = 1.0 - a + kRestSigmas * std::sqrt(a);
  return dof * root * root * root;
}

/// The density of a share between 0 and 1 by which an uncertain rolling radius errs.
double radius_density(double share, double sigma) {
  return 2.0 / (sigma * std::sqrt(2.0 * kPi)) * std::exp(-0.5 * squared(share / sigma));
}

}  // namespace

/// The score's variance of 1 contains what the bias makes of it.
void ExcessSum::add(double excess_m, const Contradiction& c, std::size_t wheel, double intervals) {
  const double sigma_m = c.excess_sigma_m[wheel];
  m += excess_m;
  variance_m2 += intervals * squared(sigma_m) * std::max(0.0, 1.0 - squared(c.drift[wheel]));
  by_bias_m += intervals * sigma_m * c.drift[wheel];
}

void ExcessSum::add(const ExcessSum& other) {
  m += other.m;
  variance_m2 += other.variance_m2;
  by_bias_m += other.by_bias_m;
}

double ExcessSum::sigma_m() const {
  return std::hypot(std::sqrt(variance_m2), by_bias_m);
}

Excesses excesses_of(const Contradiction& c) {
  Excesses excesses{};
  for (std::size_t i = 0; i < excesses.size(); ++i) excesses[i].add(c.excess_m[i], c, i);
  return excesses;
}

void SlipEvidence::begin(double start_s, std::span<const bool> checked, const SlipPrior& prior) {
  *this = {};
  prior_ = prior;
  lasts_ = true;
  start_s_ = start_s;
  for (std::size_t i = 0; i < checked.size(); ++i)
    misfit_[i] = checked[i] ? 0.0 : std::numeric_limits<double>::infinity();
}

void SlipEvidence::lasts_until(double end_s) {
  end_s_ = end_s;
  quiet_ = 0;
}

void SlipEvidence::add(const Interval& interval) {
  const Contradiction& c = interval.c;
  for (std::size_t i = 0; i < misfit_.size(); ++i) {
    misfit_[i] += std::max(0.0, c.chi2 - squared(c.score[i]));
    if (interval.misfit_by_motion) misfit_[i] += (*interval.misfit_by_motion)[i];
    travel_[i].m += c.travel[i];
    travel_[i].variance_m2 += squared(c.travel_sigma[i]);
  }
  add(excesses_of(c));
  misfit_dof_ += interval.degrees_of_freedom;
  ++intervals_;
  stuck_intervals_ += interval.is_stuck ? 1 : 0;
}

void SlipEvidence::add(const Stretch& stretch) {
  const Contradiction& c = stretch.c;
  const double n = stretch.intervals;
  for (std::size_t i = 0; i < misfit_.size(); ++i) {
    const double score = c.towards.cols() > static_cast<Eigen::Index>(i)
                             ? c.towards.col(static_cast<Eigen::Index>(i)).dot(stretch.e)
                             : 0.0;
    misfit_[i] += (stretch.e.squaredNorm() - squared(score)) / n;
    excess_[i].add(score * c.excess_sigma_m[i], c, i, n);
    travel_[i].m += stretch.travel_m[i];
    travel_[i].variance_m2 += n * squared(c.travel_sigma[i]);
  }
  misfit_dof_ += static_cast<double>(stretch.e.size() - 1);
  intervals_ += stretch.intervals;
}

void SlipEvidence::add(const Excesses& excesses) {
  for (std::size_t i = 0; i < excess_.size(); ++i) excess_[i].add(excesses[i]);
}

/// If the wheel slipped, it ran ahead of the ground.
bool SlipEvidence::spins(std::size_t wheel) const {
  return excess_[wheel].m * (travel_[wheel].m - excess_[wheel].m) >= 0.0;
}

/// Not normalised. A slip takes any share of the travel alike, density 1; a radius errs by little, and to
/// either side alike.
double SlipEvidence::prior_weight(std::size_t wheel) const {
  const double travel_m = travel_[wheel].m, slip_m = excess_[wheel].m;
  const double size_m = std::max(std::abs(travel_m), std::abs(travel_m - slip_m));
  const double by_slip = spins(wheel) ? prior_.spin_probability : 1.0 - prior_.spin_probability;
  if (size_m == 0.0) return by_slip;
  const double sigma = std::hypot(kRadiusSigma, excess_[wheel].sigma_m() / size_m);
  const double density = radius_density(std::min(1.0, std::abs(slip_m) / size_m), sigma);
  return density * prior_.radius_probability[wheel] + by_slip;
}

SlipEvidence::Attribution SlipEvidence::attribute() const {
  Attribution result;
  const double least = *std::ranges::min_element(misfit_);
  double sum = 0.0;
  for (std::size_t i = 0; i < misfit_.size(); ++i)
    sum += result.probability[i] = prior_weight(i) * std::exp(-0.5 * (misfit_[i] - least));
  for (double& p : result.probability) p /= sum;
  const auto most = std::ranges::max_element(result.probability);
  result.likeliest = static_cast<int>(most - result.probability.begin());
  result.certain =
      *most >= kCertain && misfit_[static_cast<std::size_t>(result.likeliest)] <= rest_limit(misfit_dof_);
  return result;
}

SlipEvent SlipEvidence::likeliest_event() const {
  const Attribution who = attribute();
  const auto i = static_cast<std::size_t>(who.likeliest);
  const ExcessSum& excess = excess_[i];
  const SlipKind kind = !who.certain ? SlipKind::unknown : spins(i) ? SlipKind::spin : SlipKind::skid;
  return {
      start_s_,          end_s_, who.certain ? who.likeliest : kAmbiguous, kind, excess.m, excess.sigma_m(),
      who.probability[i]};
}

std::size_t SlipEvidence::tell(std::span<SlipEvent> events) const {
  if (!is_stuck()) {
    events[0] = likeliest_event();
    return 1;
  }
  std::size_t count = 0;
  for (std::size_t i = 0; i < travel_.size(); ++i)
    if (travel_[i].m != 0.0)
      events[count++] = {
          start_s_, end_s_, static_cast<int>(i), SlipKind::stuck, travel_[i].m, travel_[i].sigma_m(), 1.0};
  return count;
}

}  // namespace trundle::slip
