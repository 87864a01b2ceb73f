#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "trundle/statistics/distribution.hpp"

namespace trundle::recording {

/// Two sensors of one motion, window by window, each in as many quantities ('channels': its turn, its way).
/// The windows are those of one of them, which is not interpolated.
struct TwoClocks {
  /// What the other one says of the windows when the clocks are so far apart: for each channel a row for each
  /// window, and beside what it says what it may err by a multiple of. Windows that it misses are not used
  /// any more.
  using Other = std::function<std::vector<Eigen::MatrixXd>(double offset_s, std::vector<bool>& used)>;

  std::vector<Eigen::VectorXd> fixed;  ///< an entry for each channel
  Eigen::VectorXd duration_s;          ///< of each window
  std::vector<bool> used;
  Other moved;
  /// By each window, in order, when it is: windows of one time err alike by what the motion errs by. None:
  /// each has a time of its own.
  std::vector<std::int64_t> times = {};
};

struct OffsetSearch {
  double given_s = 0.0;        ///< where it starts
  double largest_s = 0.0;      ///< searched on both sides of it
  double step_s = 0.0;         ///< fine enough to see the minimum
  double change_s = 0.0;       ///< by which the offset is moved to see what changes: a step of either sensor
  double least_sigma_s = 0.0;  ///< between samples rates are taken as constant: a change is known that well
  double largest_sigma_s = 0.0;
  double least_correlation = 0.0;  ///< in the channel in which the sensors agree best
};

struct ClockComparison {
  TwoClocks clocks;
  OffsetSearch search;
};

/// fixed = moved · slopes + drift · duration + residual, by least squares; nothing of less than two windows.
struct Regression {
  Eigen::VectorXd coefficients;  ///< slopes and drift
  double correlation = 0.0;
  Eigen::VectorXd residual;
  Eigen::MatrixXd design;  ///< moved and duration

  /// Of the residuals.
  [[nodiscard]] double mean_square() const;
};

/// The channels at one offset.
struct Comparison {
  std::vector<Regression> channels;
  std::vector<std::int64_t> times = {};  ///< of the windows that are used, as TwoClocks has them

  /// Least where the likelihood is largest: with Gaussian residuals of unknown variance its logarithm is
  /// −n/2 times that of this product. Of means: windows that are missed on the way are no improvement.
  [[nodiscard]] double misfit() const;
  /// Of the channel in which the sensors agree best.
  [[nodiscard]] double correlation() const;
};

/// Whether the squares of one are less than those of another by so many sigmas, by the mean and the scatter
/// of their differences, window by window, which are the same [Vuong 1989]. Slip counts for no more than
/// noise may.
[[nodiscard]] bool leaves_less(const Comparison& here, const Comparison& there, double sigmas);

/// Two clocks at any offset, in the windows that are still used.
class Comparer {
 public:
  explicit Comparer(TwoClocks clocks) : clocks_(std::move(clocks)) {}

  Comparison at(double offset_s);
  [[nodiscard]] bool has_enough() const;

  /// Leaves out windows with a residual that no noise explains.
  void leave_out_slip(double offset_s);

  /// Whether one offset leaves less than another by more than chance.
  bool is_clearly_better(double offset_s, double other_s);

  /// Whether the squares of an offset, the least there are, are less than those of a special one by more than
  /// noise makes of what changes between the two.
  bool is_clearly_not(double special_s, double offset_s);

  [[nodiscard]] const std::vector<bool>& windows() const { return clocks_.used; }
  void use(const std::vector<bool>& windows) { clocks_.used = windows; }

 private:
  TwoClocks clocks_;
};

/// The offset with the least misfit that is found on both sides of a centre.
double search_from(Comparer& compare, double centre_s, double largest_s, double step_s);

/// The offset with the least misfit, once windows where a wheel slips are left out; nothing where too few are
/// left.
std::optional<double> settled_offset(Comparer& compare, const OffsetSearch& search);

[[nodiscard]] bool speak_of_one_motion(const Comparison& comparison, const OffsetSearch& search);

/// Of a sum of values, one for each window, which may hang together over some times [Newey & West 1987].
[[nodiscard]] double variance_of_sum(const Eigen::VectorXd& of_windows,
                                     const std::vector<std::int64_t>& times = {});

/// What changes where clocks are moved by a step to either side. The windows of all three are the same.
struct Change {
  const Comparison& before;
  const Comparison& here;
  const Comparison& after;
  double step_s = 0.0;

  [[nodiscard]] bool is_of_same_windows() const;
  /// How each window pulls at the offset: its part of the derivative of half the sum of squares, channels
  /// weighed by their noise; negative.
  [[nodiscard]] Eigen::VectorXd score() const;
  /// How half the sum of squares falls and bends: that of the moved sensor's changes would count its noise as
  /// motion.
  [[nodiscard]] double slope() const;
  [[nodiscard]] double information() const;
};

/// σ of what was moved by a step to either side, from the residuals' scatter: of Newton's step, with a
/// sandwich of the scores' autocovariances [Newey & West 1987].
[[nodiscard]] double sigma_of(const Change& change);

}  // namespace trundle::recording
