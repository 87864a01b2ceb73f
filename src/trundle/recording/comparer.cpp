#include "trundle/recording/detail/comparer.hpp"

#include <algorithm>
#include <cmath>

#include "trundle/geometry/decompositions.hpp"
#include "trundle/io/interruption.hpp"
#include "trundle/statistics/median.hpp"
#include "trundle/statistics/minimum.hpp"

namespace trundle::recording {
namespace {

constexpr std::size_t kFewestWindows = 20;  // so many unrelated ones correlate by 0.5 in 1 of 40 cases
constexpr double kLargestResidual = 4.0;    // robust sigmas: beyond, a wheel slips
constexpr Eigen::Index kLags = 10;          // times over which residuals may hang together
constexpr double kFinest_s = 2e-5;          // of the search: far below the sigma of any log

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;

/// The rows of the windows that are used.
template <typename Values>
Values used_of(const Values& values, const std::vector<bool>& used) {
  Values result(std::ranges::count(used, true), values.cols());
  Eigen::Index n = 0;
  for (std::size_t w = 0; w < used.size(); ++w)
    if (used[w]) result.row(n++) = values.row(static_cast<Eigen::Index>(w));
  return result;
}

/// Beyond it no noise explains a residual; 0 where most have none.
double largest_residual(const Regression& channel) {
  std::vector<double> sizes(channel.residual.size());
  for (std::size_t i = 0; i < sizes.size(); ++i)
    sizes[i] = std::abs(channel.residual[static_cast<Eigen::Index>(i)]);
  return kLargestResidual * kSigmaOfMedian * median(sizes);
}

/// What is left of values beside multiples of others, column by column.
Vector beside(const Matrix& others, const Vector& values) {
  return values - others * least_squares(others, values);
}

Regression regress(const Vector& fixed, const Matrix& moved, const Vector& duration_s) {
  Regression result;
  if (moved.rows() < 2) return result;
  result.design.resize(moved.rows(), moved.cols() + 1);
  result.design << moved, duration_s;
  result.coefficients = least_squares(result.design, fixed);
  result.residual = fixed - result.design * result.coefficients;
  const Matrix others = result.design.rightCols(moved.cols());  // what the moved one may err by, and a drift
  const Vector w = beside(others, fixed), o = beside(others, moved.col(0));
  const double norms = w.norm() * o.norm();
  result.correlation = norms > 0.0 ? w.dot(o) / norms : 0.0;
  return result;
}

/// Sums over the windows of each time.
Vector summed_by(const std::vector<std::int64_t>& times, const Vector& values) {
  if (values.size() != std::ssize(times)) return values;  // of too few windows there are none
  Vector sums(values.size());
  Eigen::Index n = 0;
  for (std::size_t w = 0; w < times.size(); ++w) {
    if (w == 0 || times[w] != times[w - 1]) sums[n++] = 0.0;
    sums[n - 1] += values[static_cast<Eigen::Index>(w)];
  }
  return sums.head(n);
}

/// Of a channel against the first one, by their noise.
double weight(const Comparison& here, std::size_t channel) {
  return here.channels.front().mean_square() / here.channels[channel].mean_square();
}

/// The least misfit within a step of where it was seen.
double minimum_near(Comparer& compare, double offset_s, double step_s) {
  return minimum_within({offset_s - step_s, offset_s + step_s, kFinest_s},
                        [&](double at_s) { return compare.at(at_s).misfit(); });
}

/// The minimum nearest to the given offset of those that are not clearly worse than the best: who drives laps
/// sees as good a one a lap later.
double nearest_of_the_best(Comparer& compare, double best_s, const OffsetSearch& search) {
  const auto misfit = [&](double offset_s) { return compare.at(offset_s).misfit(); };
  const double away_s = std::abs(best_s - search.given_s);
  for (double distance_s = 0.0; distance_s < away_s - search.step_s; distance_s += search.step_s)
    for (const double centre_s : {search.given_s + distance_s, search.given_s - distance_s}) {
      const Comparison centre = compare.at(centre_s);
      if (std::abs(centre.correlation()) < search.least_correlation ||
          centre.misfit() > misfit(centre_s - search.step_s) ||
          centre.misfit() > misfit(centre_s + search.step_s))
        continue;
      const double offset_s = minimum_near(compare, centre_s, search.step_s);
      if (!compare.is_clearly_better(best_s, offset_s)) return offset_s;
    }
  return best_s;
}

}  // namespace

double Regression::mean_square() const {
  return residual.squaredNorm() / static_cast<double>(std::max<Eigen::Index>(residual.size(), 1));
}

double Comparison::misfit() const {
  double product = 1.0;
  for (const Regression& channel : channels) product *= channel.mean_square();
  return product;
}

double Comparison::correlation() const {
  double best = 0.0;
  for (const Regression& channel : channels)
    if (std::abs(channel.correlation) > std::abs(best)) best = channel.correlation;
  return best;
}

Comparison Comparer::at(double offset_s) {
  check_interruption();
  const std::vector<Matrix> others = clocks_.moved(offset_s, clocks_.used);
  const Vector duration_s = used_of(clocks_.duration_s, clocks_.used);
  Comparison comparison;
  for (std::size_t c = 0; c < others.size(); ++c)
    comparison.channels.push_back(
        regress(used_of(clocks_.fixed[c], clocks_.used), used_of(others[c], clocks_.used), duration_s));
  for (std::size_t w = 0; w < clocks_.times.size(); ++w)
    if (clocks_.used[w]) comparison.times.push_back(clocks_.times[w]);
  return comparison;
}

bool Comparer::has_enough() const {
  return std::ranges::count(clocks_.used, true) >= static_cast<std::ptrdiff_t>(kFewestWindows);
}

void Comparer::leave_out_slip(double offset_s) {
  const std::vector<bool> before = clocks_.used;
  for (const Regression& channel : at(offset_s).channels) {
    const double limit = largest_residual(channel);
    if (!(limit > 0.0)) continue;
    Eigen::Index n = 0;
    for (std::size_t w = 0; w < before.size(); ++w)
      if (before[w] && std::abs(channel.residual[n++]) > limit) clocks_.used[w] = false;
  }
}

bool leaves_less(const Comparison& here, const Comparison& there, double sigmas) {
  Vector gain = Vector::Zero(here.channels.front().residual.size());
  for (std::size_t c = 0; c < here.channels.size(); ++c) {
    const double limit = largest_residual(here.channels[c]);
    if (!(limit > 0.0)) continue;
    const auto squares = [&](const Regression& channel) -> Vector {
      return channel.residual.cwiseAbs().cwiseMin(limit).cwiseAbs2();
    };
    gain += (squares(there.channels[c]) - squares(here.channels[c])) / (limit * limit);
  }
  const double sum = gain.sum();
  const Vector scatter = gain.array() - sum / static_cast<double>(gain.size());
  return sum > sigmas * std::sqrt(variance_of_sum(scatter, here.times));
}

bool Comparer::is_clearly_better(double offset_s, double other_s) {
  static_cast<void>(at(offset_s));  // the windows of both
  const Comparison there = at(other_s);
  return leaves_less(at(offset_s), there, kSignificant);
}

bool Comparer::is_clearly_not(double special_s, double offset_s) {
  static_cast<void>(at(special_s));  // the windows of both
  const Comparison here = at(offset_s);
  const Comparison there = at(special_s);
  double gain = 0.0;
  Vector by_noise = Vector::Zero(here.channels.front().residual.size());
  for (std::size_t c = 0; c < here.channels.size(); ++c) {
    const Vector& residual = here.channels[c].residual;
    const Vector change = there.channels[c].residual - residual;
    gain +=
        (there.channels[c].residual.squaredNorm() - residual.squaredNorm()) / here.channels[c].mean_square();
    by_noise += 2.0 / here.channels[c].mean_square() * residual.cwiseProduct(change);
  }
  return gain > kSignificant * std::sqrt(variance_of_sum(by_noise, here.times));
}

double search_from(Comparer& compare, double centre_s, double largest_s, double step_s) {
  const auto misfit = [&](double offset_s) { return compare.at(offset_s).misfit(); };
  double best = centre_s;
  double smallest = misfit(centre_s);
  for (double offset = centre_s - largest_s; offset <= centre_s + largest_s; offset += step_s) {
    const double here = misfit(offset);
    if (here < smallest) {
      smallest = here;
      best = offset;
    }
  }
  return minimum_near(compare, best, step_s);
}

std::optional<double> settled_offset(Comparer& compare, const OffsetSearch& search) {
  if (!compare.has_enough()) return std::nullopt;
  double offset = search_from(compare, search.given_s, search.largest_s, search.step_s);
  if (!compare.has_enough()) return std::nullopt;  // the other sensor misses the rest
  offset = nearest_of_the_best(compare, offset, search);
  compare.leave_out_slip(offset);
  if (!compare.has_enough()) return std::nullopt;
  return search_from(compare, offset, 4.0 * search.step_s, search.step_s);
}

bool speak_of_one_motion(const Comparison& comparison, const OffsetSearch& search) {
  return std::abs(comparison.correlation()) >= search.least_correlation;
}

// At least a quarter of what it were if values did not hang together.
double variance_of_sum(const Vector& of_windows, const std::vector<std::int64_t>& times) {
  const Vector values = times.empty() ? of_windows : summed_by(times, of_windows);
  const double own = values.squaredNorm();
  double variance = own;
  for (Eigen::Index lag = 1; lag <= std::min(kLags, values.size() - 1); ++lag)
    variance += 2.0 * (1.0 - static_cast<double>(lag) / (kLags + 1.0)) *
                values.head(values.size() - lag).dot(values.tail(values.size() - lag));
  return std::max(variance, 0.25 * own);
}

bool Change::is_of_same_windows() const {
  for (std::size_t c = 0; c < here.channels.size(); ++c) {
    const Eigen::Index windows = here.channels[c].residual.size();
    if (before.channels[c].residual.size() != windows || after.channels[c].residual.size() != windows)
      return false;
  }
  return true;
}

Vector Change::score() const {
  Vector score = Vector::Zero(here.channels.front().residual.size());
  for (std::size_t c = 0; c < here.channels.size(); ++c) {
    const Regression& r = here.channels[c];
    Vector d = (after.channels[c].design - before.channels[c].design) * r.coefficients / (2.0 * step_s);
    d -= r.design * least_squares(r.design, d);
    score += weight(here, c) * r.residual.cwiseProduct(d);
  }
  return score;
}

double Change::slope() const {
  double sum = 0.0;
  for (std::size_t c = 0; c < here.channels.size(); ++c)
    sum += weight(here, c) *
           (after.channels[c].residual.squaredNorm() - before.channels[c].residual.squaredNorm());
  return sum / (4.0 * step_s);
}

double Change::information() const {
  double sum = 0.0;
  for (std::size_t c = 0; c < here.channels.size(); ++c)
    sum += weight(here, c) *
           (before.channels[c].residual.squaredNorm() + after.channels[c].residual.squaredNorm() -
            2.0 * here.channels[c].residual.squaredNorm());
  return sum / (2.0 * step_s * step_s);
}

double sigma_of(const Change& change) {
  if (!change.is_of_same_windows()) return INFINITY;
  const double information = change.information();
  return information > 0.0 ? std::sqrt(variance_of_sum(change.score(), change.here.times)) / information
                           : INFINITY;
}

}  // namespace trundle::recording
