#pragma once

#include <array>
#include <optional>
#include <span>

#include "trundle/slip/event.hpp"
#include "trundle/slip/parity.hpp"
#include "trundle/slip/recent_travel.hpp"

namespace trundle::slip {

/// Wheel travel that was no motion of the ground, added up over intervals.
struct ExcessSum {
  double m = 0.0;
  double variance_m2 = 0.0;  ///< by what errs independently in each interval
  double by_bias_m = 0.0;    ///< by 1σ of the gyro's bias, the same in all intervals

  /// So many intervals like this one, with that excess together.
  void add(double excess_m, const Contradiction& c, std::size_t fault, double intervals = 1.0);
  void add(const ExcessSum& other);
  double sigma_m() const;

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.m, self.variance_m2, self.by_bias_m);
  }
};

/// Of each fault, were it the one.
using Excesses = std::array<ExcessSum, kMaxFaults>;
Excesses excesses_of(const Contradiction& c, std::size_t faults);

/// A fault that takes the same share of its wheel's travel in many intervals, whose directions f differ:
/// products of travel · f with e and with itself.
struct ShareSum {
  double by_residual = 0.0;
  double by_itself = 0.0;

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.by_residual, self.by_itself);
  }
};
using ShareSums = std::array<ShareSum, kMaxFaults>;

/// What is known besides a slip's own residuals. docs/theory/slip-wheel.md, eq. 16 to 18.
struct SlipPrior {
  double spin_probability = 0.5;  ///< that a wheel which slips spins; else it skids
  PerWheel radius_probability{};  ///< of each wheel, that its radius is at fault, if one is

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.spin_probability, self.radius_probability);
  }
};

/// What speaks for each fault in a slip that lasts, and how much the wheel slips. docs/theory/slip-wheel.md.
class SlipEvidence {
 public:
  bool lasts() const { return lasts_; }
  /// One of the faults that other readings check.
  void begin(double start_s, const Faults& faults, std::span<const bool> checked, const SlipPrior& prior);
  void end() { *this = {}; }
  /// Lasts until then at least.
  void lasts_until(double end_s);
  /// One more interval without; how many there are by now.
  int be_quiet() { return ++quiet_; }

  struct Interval {
    const Contradiction& c;
    int degrees_of_freedom = 0;
    bool is_stuck = false;
    std::optional<MotionMisfit> motion = {};  ///< where nothing but that tells faults apart
  };
  void add(const Interval& interval);
  /// Many intervals as one: the sum of their residuals e and of what wheels travelled.
  struct Stretch {
    const Contradiction& c;  ///< the last of them
    int intervals = 0;
    const ParityVector& e;
    const PerWheel& travel_m;
    double chi2 = 0.0;                  ///< their sum
    const ShareSums* shares = nullptr;  ///< where wheels are steered: else directions are the last one's
  };
  void add(const Stretch& stretch);
  /// Of the interval before the first or after the last: the slip may have begun or ended within, unnoticed.
  void add(const Excesses& excesses);

  /// What the wheels' angles say by now.
  void set_radius_probability(const PerWheel& probability) { prior_.radius_probability = probability; }

  struct Attribution {
    std::size_t likeliest = 0;  ///< fault
    PerFault probability{};
    int wheel = 0;                   ///< the likeliest one, whatever its fault
    double wheel_probability = 0.0;  ///< of all its faults
    bool certain = false;            ///< of the wheel
  };
  Attribution attribute() const;
  const Faults& faults() const { return faults_; }
  /// More often than not nothing but wheels moves.
  bool is_stuck() const { return 2 * stuck_intervals_ > intervals_; }
  double excess_m(std::size_t fault) const { return excess_[fault].m; }
  double travel_m(std::size_t wheel) const { return travel_[wheel].m; }
  /// One event, or one for each wheel that turns while the robot is stuck; how many.
  std::size_t tell(std::span<SlipEvent> events) const;

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.lasts_, self.start_s_, self.end_s_, self.quiet_, self.intervals_, self.stuck_intervals_,
            self.misfit_dof_, self.faults_, self.misfit_, self.goes_on_, self.has_changed_, self.excess_,
            self.travel_, self.prior_);
  }

 private:
  SlipEvent likeliest_event() const;
  void add_shares(const Stretch& stretch);
  void add(const MotionMisfit& motion);
  double misfit(std::size_t fault) const;
  SlipKind kind_of(const Attribution& who) const;
  bool spins(std::size_t fault) const;
  double prior_weight(std::size_t fault) const;

  bool lasts_ = false;
  double start_s_ = 0.0;
  double end_s_ = 0.0;
  int quiet_ = 0;
  int intervals_ = 0;
  int stuck_intervals_ = 0;
  double misfit_dof_ = 0.0;
  Faults faults_;
  PerFault misfit_{};         ///< −2 log likelihood of this fault; infinite where nothing checks it
  PerFault goes_on_{};        ///< the same of the wheels' motion, which goes on as before the slip
  double has_changed_ = 0.0;  ///< which does not; 0: nothing was compared
  Excesses excess_{};
  std::array<ExcessSum, kMaxWheels> travel_{};  ///< all of it is excess where the robot is stuck
  SlipPrior prior_;
};

}  // namespace trundle::slip
