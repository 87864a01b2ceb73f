#include "trundle/calibration/likelihood/window_sums.hpp"

#include <cmath>

#include "trundle/chassis/rows.hpp"

namespace trundle::calibration {
namespace {

/// Travel is added up over parts of a window so short that motion does not turn round in them, and so long
/// that noise does not.
constexpr double kPartsOfAWindow = 10.0;
constexpr Increment kEmptySum{.has_gyro = true};

void add(Increment& sum, const Increment& increment) {
  add_readings(sum, increment);
  sum.time_s = increment.time_s;
  sum.gyro_change_rad_s += increment.gyro_change_rad_s;
}

/// The window that is being summed: its parts become part of the sums when it is kept.
class OpenWindow {
 public:
  explicit OpenWindow(double window_s) : window_s_(window_s) {}

  void take(std::size_t index, const Increment& increment) {
    if (sum_.duration_s == 0.0) first_ = index;
    add(sum_, increment);
    add(part_, increment);
    if (part_.duration_s >= window_s_ / kPartsOfAWindow - 1e-9) close_part();
  }
  bool is_full() const { return calibration::is_full(sum_.duration_s, window_s_); }

  void close(std::size_t last, WindowSums& sums) {
    close_part();
    if (is_kept(sum_.duration_s, window_s_)) {
      sums.windows.push_back(sum_);
      for (const Increment& part : parts_) sums.parts.push_back(part);
      sums.parts_end.push_back(sums.parts.size());
      sums.first.push_back(first_);
      sums.last.push_back(last);
    }
    sum_ = part_ = kEmptySum;
    parts_.clear();
  }

 private:
  void close_part() {
    if (part_.duration_s == 0.0) return;
    parts_.push_back(part_);
    part_ = kEmptySum;
  }

  double window_s_;
  std::size_t first_ = 0;
  Increment sum_ = kEmptySum, part_ = kEmptySum;
  std::vector<Increment> parts_;
};

}  // namespace

bool is_full(double duration_s, double window_s) {
  return duration_s >= window_s - 1e-9;  // by rounding
}

bool is_kept(double duration_s, double window_s) {
  return duration_s >= 0.5 * window_s;
}

bool is_whole(const Run& run, std::size_t increment, const Chassis& chassis) {
  return !run.readings.bridged[increment] &&
         (!chassis.gyro || !std::isnan(run.readings.increments.gyro_rad(increment)));
}

std::optional<WindowSums> window_sums(const Run& run, const Chassis& chassis, double window_s) {
  const bool with_gyro = chassis.gyro.has_value();
  if (is_steered(chassis) || observability(rows_of(chassis, with_gyro)).degrees_of_freedom == 0)
    return std::nullopt;
  const Increments& increments = run.readings.increments;
  WindowSums sums;
  sums.increments = increments.size();
  OpenWindow window(window_s);
  for (std::size_t i = 0; i < increments.size(); ++i) {
    const Increment increment = increments[i];
    const bool whole = is_whole(run, i, chassis);
    if (whole) window.take(i, increment);
    if (!whole || window.is_full()) window.close(i, sums);
  }
  return sums;
}

}  // namespace trundle::calibration
