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
void ExcessSum::add(double excess_m, const Contradiction& c, std::size_t fault, double intervals) {
  const double sigma_m = c.excess_sigma_m[fault];
  m += excess_m;
  variance_m2 += intervals * squared(sigma_m) * std::max(0.0, 1.0 - squared(c.drift[fault]));
  by_bias_m += intervals * sigma_m * c.drift[fault];
}

void ExcessSum::add(const ExcessSum& other) {
  m += other.m;
  variance_m2 += other.variance_m2;
  by_bias_m += other.by_bias_m;
}

double ExcessSum::sigma_m() const {
  return std::hypot(std::sqrt(variance_m2), by_bias_m);
}

Excesses excesses_of(const Contradiction& c, std::size_t faults) {
  Excesses excesses{};
  for (std::size_t i = 0; i < faults; ++i) excesses[i].add(c.excess_m[i], c, i);
  return excesses;
}

void SlipEvidence::begin(double start_s, const Faults& faults, std::span<const bool> checked,
                         const SlipPrior& prior) {
  *this = {};
  faults_ = faults;
  prior_ = prior;
  lasts_ = true;
  start_s_ = start_s;
  for (std::size_t i = 0; i < faults_.size(); ++i)
    misfit_[i] = checked[i] ? 0.0 : std::numeric_limits<double>::infinity();
}

void SlipEvidence::lasts_until(double end_s) {
  end_s_ = end_s;
  quiet_ = 0;
}

void SlipEvidence::add(const Interval& interval) {
  const Contradiction& c = interval.c;
  for (std::size_t i = 0; i < faults_.size(); ++i) {
    misfit_[i] += std::max(0.0, c.chi2 - squared(c.score[i]));
    excess_[i].add(c.excess_m[i], c, i);
  }
  if (interval.motion) add(*interval.motion);
  for (std::size_t i = 0; i < travel_.size(); ++i) {
    travel_[i].m += c.travel[i];
    travel_[i].variance_m2 += squared(c.travel_sigma[i]);
  }
  misfit_dof_ += interval.degrees_of_freedom;
  ++intervals_;
  stuck_intervals_ += interval.is_stuck ? 1 : 0;
}

void SlipEvidence::add(const MotionMisfit& motion) {
  for (std::size_t i = 0; i < faults_.size(); ++i) goes_on_[i] += motion.goes_on[i];
  has_changed_ += (has_changed_ == 0.0 ? motion.changes : 0.0) + motion.whatever;
}

/// Of the residuals, and of a motion that goes on or has changed, one as likely as the other: a wheel loses
/// its hold as the robot takes another speed as well as on its way. docs/theory/slip-wheel.md, eq. 9a.
double SlipEvidence::misfit(std::size_t fault) const {
  const double least = std::min(goes_on_[fault], has_changed_);
  const double by_motion = least - 2.0 * std::log(0.5 * (std::exp(-0.5 * (goes_on_[fault] - least)) +
                                                         std::exp(-0.5 * (has_changed_ - least))));
  return misfit_[fault] + by_motion;
}

void SlipEvidence::add(const Stretch& stretch) {
  const Contradiction& c = stretch.c;
  const double n = stretch.intervals;
  if (stretch.shares != nullptr) add_shares(stretch);
  for (std::size_t i = 0; stretch.shares == nullptr && i < faults_.size(); ++i) {
    const bool shows = c.excess_sigma_m[i] > 0.0;
    const double score = shows ? c.towards.col(static_cast<Eigen::Index>(i)).dot(stretch.e) : 0.0;
    misfit_[i] += (stretch.e.squaredNorm() - squared(score)) / n;
    excess_[i].add(score * c.excess_sigma_m[i], c, i, n);
  }
  for (std::size_t i = 0; i < travel_.size(); ++i) {
    travel_[i].m += stretch.travel_m[i];
    travel_[i].variance_m2 += n * squared(c.travel_sigma[i]);
  }
  misfit_dof_ += static_cast<double>(stretch.e.size()) * (stretch.shares != nullptr ? n : 1.0) - 1.0;
  intervals_ += stretch.intervals;
}

/// docs/theory/slip-wheel.md, eq. 16a.
void SlipEvidence::add_shares(const Stretch& stretch) {
  for (std::size_t i = 0; i < faults_.size(); ++i) {
    const ShareSum& sum = (*stretch.shares)[i];
    misfit_[i] += stretch.chi2;
    if (sum.by_itself <= 0.0) continue;
    const double share = sum.by_residual / sum.by_itself;
    const double travel_m = stretch.travel_m[static_cast<std::size_t>(faults_[i].wheel)];
    misfit_[i] -= share * sum.by_residual;
    excess_[i].m += share * travel_m;
    excess_[i].variance_m2 += squared(travel_m) / sum.by_itself;
  }
}

void SlipEvidence::add(const Excesses& excesses) {
  for (std::size_t i = 0; i < faults_.size(); ++i) excess_[i].add(excesses[i]);
}

/// If the wheel slipped, it ran ahead of the ground.
bool SlipEvidence::spins(std::size_t fault) const {
  const double travel_m = travel_[static_cast<std::size_t>(faults_[fault].wheel)].m;
  return excess_[fault].m * (travel_m - excess_[fault].m) >= 0.0;
}

/// Not normalised. A slip takes any share of the travel alike, density 1; a radius or a steering errs by
/// little, and to either side alike. Along or across, to the left or to the right: before anything is known
/// as likely.
double SlipEvidence::prior_weight(std::size_t fault) const {
  const auto wheel = static_cast<std::size_t>(faults_[fault].wheel);
  const double travel_m = travel_[wheel].m, slip_m = excess_[fault].m;
  const double ground_m = faults_[fault].sideways ? slip_m : travel_m - slip_m;
  const double size_m = std::max(std::abs(travel_m), std::abs(ground_m));
  const double by_slip = faults_[fault].sideways ? 0.5
                         : spins(fault)          ? prior_.spin_probability
                                                 : 1.0 - prior_.spin_probability;
  if (size_m == 0.0) return by_slip;
  const double sigma = std::hypot(kRadiusSigma, excess_[fault].sigma_m() / size_m);
  const double density = radius_density(std::min(1.0, std::abs(slip_m) / size_m), sigma);
  return density * prior_.radius_probability[wheel] + by_slip;
}

SlipEvidence::Attribution SlipEvidence::attribute() const {
  Attribution result;
  PerFault each{};
  for (std::size_t i = 0; i < faults_.size(); ++i) each[i] = misfit(i);
  const std::span<const double> misfits(each.data(), faults_.size());
  const std::span<double> probability(result.probability.data(), faults_.size());
  const double least = *std::ranges::min_element(misfits);
  double sum = 0.0;
  for (std::size_t i = 0; i < faults_.size(); ++i)
    sum += probability[i] = prior_weight(i) * std::exp(-0.5 * (misfits[i] - least));
  for (double& p : probability) p /= sum;
  PerWheel of_wheel{};
  for (std::size_t i = 0; i < faults_.size(); ++i)
    of_wheel[static_cast<std::size_t>(faults_[i].wheel)] += probability[i];
  const auto most = std::ranges::max_element(of_wheel);
  result.wheel = static_cast<int>(most - of_wheel.begin());
  result.wheel_probability = *most;
  result.likeliest = static_cast<std::size_t>(result.wheel);  // its slip, which stands there
  for (std::size_t i = 0; i < faults_.size(); ++i)
    if (faults_[i].wheel == result.wheel && probability[i] > probability[result.likeliest])
      result.likeliest = i;
  result.certain = *most >= kCertain && misfit_[result.likeliest] <= rest_limit(misfit_dof_);
  return result;
}

/// Of a wheel that is certain.
SlipKind SlipEvidence::kind_of(const Attribution& who) const {
  if (who.probability[who.likeliest] < kCertain * who.wheel_probability) return SlipKind::unknown;
  if (faults_[who.likeliest].sideways) return SlipKind::sideways;
  return spins(who.likeliest) ? SlipKind::spin : SlipKind::skid;
}

SlipEvent SlipEvidence::likeliest_event() const {
  const Attribution who = attribute();
  const ExcessSum& excess = excess_[who.likeliest];
  return {.start_s = start_s_,
          .end_s = end_s_,
          .wheel = who.certain ? who.wheel : kAmbiguous,
          .kind = who.certain ? kind_of(who) : SlipKind::unknown,
          .excess_m = excess.m,
          .excess_sigma_m = excess.sigma_m(),
          .confidence = who.wheel_probability};
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
