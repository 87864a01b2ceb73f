#include "trundle/recording/time_offset.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <Eigen/Core>

#include "trundle/chassis/rows.hpp"
#include "trundle/geometry/decompositions.hpp"
#include "trundle/recording/csv/detail/table.hpp"
#include "trundle/statistics/median.hpp"
#include "trundle/statistics/minimum.hpp"

namespace trundle::recording {
namespace {

constexpr std::size_t kFewestWindows = 20;
constexpr double kSameTurns = 0.5;  // correlation below which the sensors do not speak of the same motion
constexpr double kLargestResidual = 4.0;  // robust sigmas: beyond, a wheel slips
constexpr Eigen::Index kLags = 10;        // windows over which residuals may hang together
constexpr double kFinest_s = 2e-5;

using Vector = Eigen::VectorXd;

/// Windows of contiguous intervals: what the wheels turned, and by which increments.
struct Windows {
  AlignedReadings readings;
  std::vector<std::size_t> first;  ///< increment of each window; the last entry ends the last window
  std::vector<bool> used;
  Vector by_wheels;
  Vector duration_s;

  std::size_t count() const { return used.size(); }
};

/// Windows of the wheels alone; those for which the gyro runs at any offset of the search.
Windows windows_of(const Recording& recording, const AlignedReadings& readings, const Robot& robot,
                   const TimeOffsetOptions& options) {
  Windows windows{.readings = readings, .first = {0}, .used = {}, .by_wheels = {}, .duration_s = {}};
  const Rows rows = rows_of(robot.chassis, false);
  const double gyro_offset_s = robot.chassis.gyro->time_offset_s;
  const double start_s = recording.gyro.time_s.front() + gyro_offset_s + options.largest_s;
  const double end_s = recording.gyro.time_s.back() + gyro_offset_s - options.largest_s;
  std::vector<double> turns, durations;
  double turn = 0.0, duration_s = 0.0;
  bool whole = true;
  const auto& increments = windows.readings.increments;
  for (std::size_t i = 0; i < increments.size(); ++i) {
    turn += twist_of(robot.chassis, rows, increments[i]).dtheta;
    duration_s += increments[i].duration_s;
    whole = whole && !windows.readings.bridged[i];
    if (duration_s < options.window_s - 1e-9) continue;
    const double end = increments[i].time_s;
    windows.used.push_back(whole && end - duration_s >= start_s && end <= end_s);
    windows.first.push_back(i + 1);
    turns.push_back(turn);
    durations.push_back(duration_s);
    turn = duration_s = 0.0;
    whole = true;
  }
  windows.by_wheels = Eigen::Map<const Vector>(turns.data(), static_cast<Eigen::Index>(turns.size()));
  windows.duration_s =
      Eigen::Map<const Vector>(durations.data(), static_cast<Eigen::Index>(durations.size()));
  return windows;
}

/// What the gyro turned in each window with its stamps moved by `offset_s`. Windows that it misses are not
/// used any more.
Vector turns_by_gyro(const Recording& recording, const Robot& robot, double offset_s, Windows& windows) {
  Robot moved = robot;
  moved.chassis.gyro->time_offset_s = offset_s;
  add_gyro(recording.gyro, moved, windows.readings);
  Vector turns = Vector::Zero(static_cast<Eigen::Index>(windows.count()));
  for (std::size_t w = 0; w < windows.count(); ++w)
    for (std::size_t i = windows.first[w]; i < windows.first[w + 1]; ++i) {
      const Increment& increment = windows.readings.increments[i];
      if (!increment.has_gyro) windows.used[w] = false;
      turns[static_cast<Eigen::Index>(w)] += increment.gyro_rad;
    }
  windows.readings.problems.clear();
  return turns;
}

/// The entries of the windows that are used.
Vector used_of(const Vector& values, const std::vector<bool>& used) {
  Vector result(std::ranges::count(used, true));
  Eigen::Index n = 0;
  for (std::size_t w = 0; w < used.size(); ++w)
    if (used[w]) result[n++] = values[static_cast<Eigen::Index>(w)];
  return result;
}

/// wheels = slope · gyro + drift · duration + residual, by least squares; nothing of less than two windows.
struct Regression {
  double slope = 0.0;
  double correlation = 0.0;
  Vector residual;
  Eigen::MatrixXd design;  ///< gyro and duration
};

Regression regress(const Vector& by_wheels, const Vector& by_gyro, const Vector& duration_s) {
  Regression result;
  if (by_gyro.size() < 2) return result;
  result.design.resize(by_gyro.size(), 2);
  result.design << by_gyro, duration_s;
  const Vector coefficients = least_squares(result.design, by_wheels);
  result.slope = coefficients[0];
  result.residual = by_wheels - result.design * coefficients;
  const Vector w = by_wheels - duration_s * (by_wheels.dot(duration_s) / duration_s.squaredNorm());
  const Vector g = by_gyro - duration_s * (by_gyro.dot(duration_s) / duration_s.squaredNorm());
  const double norms = w.norm() * g.norm();
  result.correlation = norms > 0.0 ? w.dot(g) / norms : 0.0;
  return result;
}

/// All that the search compares.
class Search {
 public:
  Search(const Recording& recording, const Robot& robot, Windows windows)
      : recording_(recording), robot_(robot), windows_(std::move(windows)) {}

  Regression at(double offset_s) {
    const Vector by_gyro = turns_by_gyro(recording_, robot_, offset_s, windows_);
    return regress(used_of(windows_.by_wheels, windows_.used), used_of(by_gyro, windows_.used),
                   used_of(windows_.duration_s, windows_.used));
  }
  /// Mean square of the residuals: windows that the gyro misses on the way do not count as an improvement.
  double misfit(double offset_s) {
    const Regression regression = at(offset_s);
    return regression.residual.squaredNorm() /
           static_cast<double>(std::max<Eigen::Index>(regression.residual.size(), 1));
  }
  std::size_t used() const { return static_cast<std::size_t>(std::ranges::count(windows_.used, true)); }

  /// Leaves out windows whose residual no noise explains.
  void leave_out_slip(double offset_s) {
    const Regression regression = at(offset_s);
    std::vector<double> sizes(regression.residual.size());
    for (std::size_t i = 0; i < sizes.size(); ++i)
      sizes[i] = std::abs(regression.residual[static_cast<Eigen::Index>(i)]);
    const double limit = kLargestResidual * kSigmaOfMedian * median(sizes);
    if (!(limit > 0.0)) return;
    std::size_t n = 0;
    for (std::size_t w = 0; w < windows_.count(); ++w)
      if (windows_.used[w] && sizes[n++] > limit) windows_.used[w] = false;
  }

 private:
  const Recording& recording_;
  const Robot& robot_;
  Windows windows_;
};

double search_from(Search& search, double centre_s, double largest_s, double step_s) {
  double best = centre_s;
  double smallest = search.misfit(centre_s);
  for (double offset = centre_s - largest_s; offset <= centre_s + largest_s; offset += step_s) {
    const double misfit = search.misfit(offset);
    if (misfit < smallest) {
      smallest = misfit;
      best = offset;
    }
  }
  return minimum_within({best - step_s, best + step_s, kFinest_s},
                        [&](double offset) { return search.misfit(offset); });
}

/// σ of the offset from the residuals' scatter, which may hang together over some windows [Newey & West
/// 1987].
double sigma_at(Search& search, double offset_s, double step_s) {
  const Regression here = search.at(offset_s);
  const Regression before = search.at(offset_s - step_s);
  const Regression after = search.at(offset_s + step_s);
  if (before.residual.size() != here.residual.size() || after.residual.size() != here.residual.size())
    return INFINITY;
  Vector d = here.slope * (after.design.col(0) - before.design.col(0)) / (2.0 * step_s);
  d -= here.design * least_squares(here.design, d);
  const Vector g = here.residual.cwiseProduct(d);
  const double own = g.squaredNorm();
  double variance = own;
  for (Eigen::Index lag = 1; lag <= std::min(kLags, g.size() - 1); ++lag)
    variance += 2.0 * (1.0 - static_cast<double>(lag) / (kLags + 1.0)) *
                g.head(g.size() - lag).dot(g.tail(g.size() - lag));
  return std::sqrt(std::max(variance, 0.25 * own)) / d.squaredNorm();
}

}  // namespace

std::optional<TimeOffset> gyro_time_offset(const Recording& recording, const Robot& robot,
                                           const TimeOffsetOptions& options) {
  if (!robot.chassis.gyro || recording.gyro.time_s.size() < 2) return std::nullopt;
  return gyro_time_offset(recording, align(recording, robot), robot, options);
}

std::optional<TimeOffset> gyro_time_offset(const Recording& recording, const AlignedReadings& readings,
                                           const Robot& robot, const TimeOffsetOptions& options) {
  if (!robot.chassis.gyro || recording.gyro.time_s.size() < 2) return std::nullopt;
  if (observability(rows_of(robot.chassis, false)).rank < 3) return std::nullopt;
  const double gyro_step_s = median_step(recording.gyro.time_s);
  Search search(recording, robot, windows_of(recording, readings, robot, options));
  if (search.used() < kFewestWindows) return std::nullopt;
  const double given_s = robot.chassis.gyro->time_offset_s;
  const double step_s = std::max(0.25 * options.window_s, 0.5 * gyro_step_s);
  double offset = search_from(search, given_s, options.largest_s, step_s);
  if (search.used() < kFewestWindows) return std::nullopt;  // the gyro misses the others
  search.leave_out_slip(offset);
  if (search.used() < kFewestWindows) return std::nullopt;
  offset = search_from(search, offset, 4.0 * step_s, step_s);
  const double correlation = search.at(offset).correlation;
  // Between its samples the gyro's rate is taken as constant: the instant of a change is known that well.
  const double sigma = std::hypot(sigma_at(search, offset, gyro_step_s), gyro_step_s / 50.0);
  const bool told = std::abs(correlation) >= kSameTurns && sigma <= options.largest_sigma_s &&
                    std::abs(offset - given_s) <= options.largest_s;
  if (!told) return std::nullopt;
  return TimeOffset{offset, sigma, correlation};
}

}  // namespace trundle::recording
