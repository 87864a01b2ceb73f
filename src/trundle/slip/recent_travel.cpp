#include "trundle/slip/recent_travel.hpp"

#include <algorithm>
#include <cmath>

#include "trundle/geometry/squared.hpp"

namespace trundle::slip {
namespace {

// Rolling resistance, 2 % of the weight, slows a robot that coasts [m/s²]; to slow down faster takes brakes.
constexpr double kCoasting_m_s2 = 0.2;

/// How far a change is from what a wheel that slips by `excess` shows. It spins: its motor lets it run away
/// by the excess, or holds its rate so that the ground falls behind, or something between. It skids: it loses
/// the excess itself, for the ground does not run ahead of wheels that hold their rate.
double distance_from_slip(double change, double excess, bool spins) {
  if (!spins) return change - excess;
  return change - std::clamp(change, std::min(0.0, excess), std::max(0.0, excess));
}

}  // namespace

bool RecentTravel::jumps(const Contradiction& interval, double duration_s, std::size_t wheels) const {
  for (std::size_t i = 0; intervals_ > 0 && i < wheels; ++i) {
    const Change c = change(i, interval, duration_s);
    if (std::abs(c.value) > kJump * std::max(c.sigma, kRipple * std::abs(interval.travel[i]))) return true;
  }
  return false;
}

void RecentTravel::add(const Contradiction& interval, double duration_s, std::size_t wheels) {
  if (jumps(interval, duration_s, wheels)) forget(mean_change(interval, duration_s, wheels).value < 0.0);
  intervals_ = std::min(intervals_ + 1, kMemory);
  const double gain = std::max(kGain, 1.0 / intervals_);
  // The first interval has nothing to be compared with.
  const double memory = 1.0 / std::max(1, intervals_ - 1);
  for (std::size_t i = 0; i < wheels; ++i) {
    if (intervals_ == 1) {
      rate_[i] = interval.travel[i] / duration_s;
      variance_[i] = 0.0;
      continue;
    }
    const double change = interval.travel[i] - rate_[i] * duration_s;
    rate_[i] += gain * change / duration_s;
    variance_[i] += memory * (squared(change) / growth() - variance_[i]);
  }
  passed_ = 0;
}

RecentTravel::Change RecentTravel::change(std::size_t wheel, const Contradiction& interval,
                                          double duration_s) const {
  // Of an interval's own noise and that of the smoothed rate before it.
  const double noise = squared(interval.travel_sigma[wheel]) * 2.0 / (2.0 - kGain);
  return {interval.travel[wheel] - rate_[wheel] * duration_s,
          std::sqrt(growth() * std::max(noise, variance_[wheel]))};
}

RecentTravel::Change RecentTravel::mean_change(const Contradiction& interval, double duration_s,
                                               std::size_t wheels) const {
  Change mean{0.0, 0.0};
  for (std::size_t i = 0; i < wheels; ++i) {
    const Change c = change(i, interval, duration_s);
    mean.value += std::copysign(1.0, rate_[i]) * c.value / static_cast<double>(wheels);
    mean.sigma = std::hypot(mean.sigma, c.sigma / static_cast<double>(wheels));
  }
  return mean;
}

double RecentTravel::push_probability(const Contradiction& interval, double duration_s,
                                      std::size_t wheels) const {
  if (intervals_ == 0) return slows_ ? 0.0 : 1.0;
  const Change mean = mean_change(interval, duration_s, wheels);
  const double coasts = kCoasting_m_s2 * squared(duration_s);
  return 0.5 * std::erfc(-(mean.value + coasts) / (std::sqrt(2.0) * mean.sigma));
}

double RecentTravel::misfit(const Fault& fault, const Contradiction& interval, double duration_s,
                            std::size_t wheels) const {
  const auto slips = static_cast<std::size_t>(fault.wheel);
  double sum = 0.0;
  for (std::size_t j = 0; j < wheels; ++j) {
    const Change c = change(j, interval, duration_s);
    const double excess = interval.excess_m[slips];
    const bool spins = excess * rate_[slips] >= 0.0;
    const double distance =
        j == slips && !fault.sideways ? distance_from_slip(c.value, excess, spins) : c.value;
    sum += squared(distance / c.sigma);
  }
  return sum;
}

MotionMisfit RecentTravel::misfit(const Faults& faults, const Contradiction& interval, double duration_s,
                                  std::size_t wheels) const {
  MotionMisfit result;
  for (std::size_t i = 0; i < faults.size(); ++i)
    result.goes_on[i] = misfit(faults[i], interval, duration_s, wheels);
  double fastest_m = 0.0;
  for (std::size_t j = 0; j < wheels; ++j) fastest_m = std::max(fastest_m, std::abs(expected(j, duration_s)));
  for (std::size_t j = 0; j < wheels; ++j) {
    // Density of any change up to the whole speed, either way, against the highest of 'as before'.
    const double peak_m = std::sqrt(2.0 * kPi) * change(j, interval, duration_s).sigma;
    result.changes -= 2.0 * std::log(std::min(1.0, peak_m / (2.0 * fastest_m)));
  }
  result.whatever = static_cast<double>(wheels);  // the mean of χ²
  return result;
}

}  // namespace trundle::slip
