#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "trundle/calibration/likelihood/common_errors.hpp"
#include "trundle/calibration/likelihood/contradiction.hpp"
#include "trundle/calibration/likelihood/steered_window.hpp"
#include "trundle/calibration/likelihood/window_sums.hpp"
#include "trundle/calibration/problem/run.hpp"
#include "trundle/chassis/parameter.hpp"

namespace trundle::calibration {

/// The windows of a run over which what no motion explains is summed, one after the other.
/// docs/theory/calibration-redundancy.md, eq. 7.
class ParityWindows {
 public:
  /// All must outlive it. `chassis`: with the noise that contradicts; `weighing`: with that by which odometry
  /// weighs readings. `sums`: window_sums() of the run over `window_s`, where they are known already.
  /// `with_errors`: Contradiction::J_errors.
  ParityWindows(const Run& run, const Chassis& chassis, const Chassis& weighing,
                std::span<const Parameter> parameters, double window_s, const WindowSums* sums,
                bool with_errors);
  ParityWindows(const ParityWindows&) = delete;

  /// Whether there are any: there are more readings than a motion needs.
  [[nodiscard]] bool any() const { return steered_ || rigid_; }
  /// Goes on to the next increment. Returns what was summed where a window ends there. `before`: how the
  /// robot had rolled, for errors that are common with odometry's; null: nobody asks for them.
  std::optional<Contradiction> take(const Rolling* before = nullptr);
  /// Whether that increment is part of a window.
  [[nodiscard]] bool is_within() const { return within_; }
  /// If it is: by which combinations its readings add to the sum.
  [[nodiscard]] const Combinations& combinations() const {
    return steered_ ? steered_->combinations() : rigid_->comparison.P;
  }
  /// Of the motion that odometry made of the increments since this was asked last, with the sum.
  [[nodiscard]] CommonError take_common_error();
  void drop_common_error();

 private:
  /// Where no wheel is steered, all windows are compared by the same combinations of readings.
  struct Rigid {
    Rigid(const Chassis& chassis, const Chassis& weighing, std::span<const Parameter> parameters,
          const WindowSums& given);
    void add(const Increment& increment, Rolling before);
    /// Of the window that is next.
    Contradiction next(bool with_errors);

    Rows rows;
    Comparison comparison;
    RowVector rounding;
    CommonErrors common;
    Rolled rolled{};  ///< since common errors were asked for last, in so long
    double duration_s = 0.0;
    std::size_t octave = 0;
    const WindowSums& sums;
    std::size_t window = 0;
    std::size_t part = 0;  ///< its first one
  };
  std::optional<Contradiction> take_steered(std::size_t index, const Rolling* before);
  std::optional<Contradiction> take_rigid(std::size_t index, const Rolling* before);

  const Run& run_;
  const Chassis& chassis_;
  double window_s_;
  bool with_errors_;
  std::optional<WindowSums> own_sums_;
  std::optional<Rigid> rigid_;
  std::optional<SteeredWindow> steered_;
  CommonError steered_common_;
  RollingGauge gauge_;
  std::size_t taken_ = 0;  ///< increments
  bool within_ = false;
};

}  // namespace trundle::calibration
