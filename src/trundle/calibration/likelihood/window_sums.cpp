#include "trundle/calibration/likelihood/window_sums.hpp"

#include "trundle/chassis/rows.hpp"

namespace trundle::calibration {
namespace {

/// Travel is added up over parts of a window so short that motion does not turn round in them, and so long
/// that noise does not.
constexpr double kPartsOfAWindow = 10.0;
constexpr Increment kEmptySum{.has_gyro = true};

void add(Increment& sum, const Increment& increment) {
  add_readings(sum, increment);
  sum.gyro_change_rad_s += increment.gyro_change_rad_s;
}

/// The window that is being summed: its parts become part of the sums when it is kept.
class OpenWindow {
 public:
  explicit OpenWindow(double window_s) : window_s_(window_s) {}

  void take(const Increment& increment) {
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
    const bool broken = run.readings.bridged[i] || (with_gyro && !increment.has_gyro);
    if (!broken) window.take(increment);
    if (broken || window.is_full()) window.close(i, sums);
  }
  return sums;
}

}  // namespace trundle::calibration
