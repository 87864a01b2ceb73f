#pragma once

#include <optional>
#include <span>

#include "trundle/slip/band.hpp"
#include "trundle/slip/correction.hpp"
#include "trundle/slip/cusum.hpp"
#include "trundle/slip/event.hpp"
#include "trundle/slip/evidence.hpp"
#include "trundle/slip/parity.hpp"
#include "trundle/slip/published.hpp"
#include "trundle/slip/recent_travel.hpp"
#include "trundle/slip/uneven_wheel.hpp"

namespace trundle::slip {

enum class SlipMethod {
  general,    ///< any chassis: χ² on what the rows cannot explain, attribution by rows, cumulative sums
  published,  ///< two wheels and a gyro, nearly straight driving: source 2's rule as it stands, in every
              ///< interval
};

struct SlipOptions {
  SlipMethod method = SlipMethod::general;
  double probability = 0.01;  ///< that an interval without slip is flagged
  /// The same for the cumulative sums of the general method, as a share of `probability`.
  double persistent_share = 0.1;
  double interval_s =
      0.25;  ///< readings are judged over at least this long; those that are longer one by one
  /// How much likelier a driven wheel that slips while it pushes spins than skids; while it brakes, the other
  /// way round. `general` only: `published` takes it for certain.
  double spin_odds = 10.0;
  std::optional<ResidualModel> model = {};  ///< learned from clean recordings, for `general`
  std::optional<Band> band = {};            ///< the same for `published`
};

/// Why an interval was not judged, or that it was.
enum class SlipStatus {
  judged,
  parked,          ///< no wheel turned
  no_gyro,         ///< a gap of the gyro, or it was saturated
  not_applicable,  ///< `published`: not nearly straight
  not_learned,     ///< another length of interval or speed than the band was learned at
};

/// What became of the commanded motion since the interval before.
struct CommandChange {
  bool changed = false;
  bool slows = false;  ///< to a slower one

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.changed, self.slows);
  }
};

/// The verdict on one interval.
struct SlipVerdict {
  SlipStatus status = SlipStatus::judged;
  bool alarm = false;       ///< this interval alone contradicts itself
  bool persistent = false;  ///< a cumulative sum is beyond its limit
  bool slipping = false;    ///< within a slip
  int wheel = kAmbiguous;   ///< as far as is known by now
  double chi2 = 0.0;
  double limit = 0.0;
  double statistic = 0.0;  ///< what raises the alarm: χ², or δ [rad] where by_band(); 0 where not judged
  SlipCorrection correction;
  std::array<SlipEvent, kMaxWheels> ended{};  ///< slips that ended before this interval
  std::size_t ended_count = 0;
};

/// Judges intervals one after the other: plain numbers, bounded time, no heap. docs/theory/slip-detection.md.
class SlipDetector {
 public:
  /// Throws CannotAnswer where the robot's sensors cannot show slip, or do not suit the method.
  SlipDetector(const Robot& robot, const SlipOptions& options);

  SlipVerdict step(const JudgedInterval& judged, CommandChange command = {});
  /// Ends the slip that lasts, if any.
  SlipVerdict finish();
  /// The same where the readings are interrupted: what was before is no guide.
  SlipVerdict interrupt();

  /// Whether an interval can be judged.
  SlipStatus status_of(const Increment& interval) const;
  /// δ = (dR − dL)/B − g of two wheels and a gyro [rad].
  double delta(const Contradiction& c) const { return published_delta(c, parity_.rows()); }
  const Parity& parity() const { return parity_; }
  /// Is δ judged by the learned band, and not χ² by its limit?
  bool by_band() const { return options_.method == SlipMethod::published && options_.band; }
  double limit() const { return limit_; }
  double persistent_limit() const { return persistent_limit_; }

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.recent_, self.uneven_, self.sums_, self.event_, self.before_);
  }

 private:
  /// A cumulative sum, and what was added up since it last was zero.
  struct Sum {
    Cusum cusum;
    double start_s = 0.0;
    int intervals = 0;
    ParityVector e;
    PerWheel travel{};
    double chi2 = 0.0;  ///< this and the next where wheels are steered
    ShareSums shares{};

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.cusum, self.start_s, self.intervals, self.e, self.travel, self.chi2, self.shares);
    }
  };

  void state_statistic(const Contradiction& c, SlipVerdict& verdict) const;
  bool accumulate(const Contradiction& c, const Increment& interval);
  void add_shares(const Contradiction& c, Sum& sum) const;
  void judge(const Contradiction& c, const Increment& interval, SlipVerdict& verdict);
  void wait(const Contradiction& c, SlipVerdict& verdict);
  void begin(const Contradiction& c, const Increment& interval, bool persistent);
  void add_evidence(const Contradiction& c, const Increment& interval);
  bool may_have_begun(const Contradiction& c) const;
  bool holds_on(const Contradiction& c) const;
  bool is_another(const Contradiction& c) const;
  int wheel_by_rule(const Contradiction& c) const;
  std::array<bool, kMaxFaults> candidates(const Contradiction& c) const;
  SlipPrior prior(const Contradiction& c, double duration_s) const;
  void correct(const Contradiction& c, const GyroBias& bias, SlipVerdict& verdict) const;
  void end_event(SlipVerdict& verdict);
  std::span<std::array<Sum, 2>> sums() { return {sums_.data(), parity_.faults().size()}; }
  void forget_sums();
  void forget();

  Parity parity_;
  SlipOptions options_;
  double limit_ = 0.0;
  double persistent_limit_ = 0.0;
  std::array<bool, kMaxFaults> checked_{};
  RecentTravel recent_;
  UnevenWheel uneven_;
  std::array<std::array<Sum, 2>, kMaxFaults> sums_{};  ///< of both signs
  SlipEvidence event_;
  Excesses before_{};  ///< in the interval just before, where nothing slipped
};

}  // namespace trundle::slip
