#pragma once

#include <optional>
#include <string>
#include <vector>

#include "trundle/odometry/integrate.hpp"
#include "trundle/slip/learn.hpp"
#include "trundle/slip/slip_odometer.hpp"

namespace trundle::slip {

/// How many intervals met which fate.
struct SlipCounts {
  std::size_t intervals = 0;
  std::size_t judged = 0;
  std::size_t parked = 0;
  std::size_t no_gyro = 0;
  std::size_t not_applicable = 0;
  std::size_t not_learned = 0;
  std::size_t alarms = 0;    ///< contradict themselves
  std::size_t slipping = 0;  ///< within a slip
  double by_chance = 0.0;    ///< alarms to be expected in those that are judged if nothing slips

  [[nodiscard]] double flagged_share() const {
    return judged == 0 ? 0.0 : static_cast<double>(slipping) / static_cast<double>(judged);
  }
};

/// One interval, and what it was judged by.
struct SlipInterval {
  double end_s = 0.0;
  SlipStatus status = SlipStatus::judged;
  double statistic = 0.0;  ///< χ², or δ [rad] where SlipReport::band is there
  bool slipping = false;
};

/// The slips of a recording, and how its readings are corrected for them.
struct SlipReport {
  std::vector<SlipEvent> events;
  SlipCounts counts;
  double trials = 0.0;  ///< chances of noise to make a slip: intervals that were judged, for each fault
  std::vector<SlipInterval> intervals;
  std::optional<Band> band;                ///< δ raises an alarm outside it
  double chi2_limit = 0.0;                 ///< else χ² does beyond this
  std::vector<CorrectedSpan> corrections;  ///< of increments; the others stay as they are
  Pose2 end;                               ///< the pose reached, from the origin
  std::vector<Finding> findings;
};

/// Walks through commands along with increments.
class CommandChanges {
 public:
  /// They may be empty, and must outlive it.
  explicit CommandChanges(const VelocityStream& commands) : commands_(commands) {}

  /// What became of the command up to this time, since the last one that was asked for.
  CommandChange until(double time_s);

 private:
  const VelocityStream& commands_;
  std::size_t next_ = 0;
};

/// A SlipOdometer that learns the gyro's bias where the robot rests, and what became of its intervals.
class SlipSearch {
 public:
  /// `commands` may be empty, and must outlive it. Throws as the SlipOdometer does.
  SlipSearch(const Robot& robot, const VelocityStream& commands, const SlipOptions& options = {});

  /// The next increment of the recording. `bridged`: its course is not known.
  void step(const Increment& increment, bool bridged);
  /// `start_s`: of the first one. Throws CannotAnswer where the robot moves but no interval can be judged.
  [[nodiscard]] SlipReport finish(double start_s);

 private:
  void correct_until(std::size_t end, const SlipCorrection& correction);

  SlipOdometer odometer_;
  CommandChanges changes_;
  SlipOptions options_;
  std::size_t increments_ = 0;
  std::size_t interval_begin_ = 0;  ///< the first one of the interval that is not complete yet
  SlipReport report_;
};

/// A loop over SlipSearch::step.
[[nodiscard]] SlipReport find_slip(const AlignedReadings& readings, const VelocityStream& commands,
                                   const Robot& robot, const SlipOptions& options = {});

/// The readings in which `report` was found, corrected: ready for integrate().
[[nodiscard]] AlignedReadings corrected(AlignedReadings readings, const SlipReport& report,
                                        const Robot& robot);

/// What the readings are judged by, interval by interval: for learning from a recording without slip.
[[nodiscard]] std::vector<JudgedInterval> clean_intervals(const AlignedReadings& readings, const Robot& robot,
                                                          double interval_s);

/// For each event, which share of those that are as many sigmas or more noise alone makes: the false
/// discovery rate at which it is found [Benjamini, Hochberg 1995]. docs/theory/slip-detection.md, eq. 10a.
[[nodiscard]] std::vector<double> shares_by_chance(const SlipReport& report);
/// Those with a share below kClearSlip.
[[nodiscard]] std::vector<SlipEvent> clear_slips(const SlipReport& report);

/// `start_s,end_s,wheel,kind,excess_m,confidence,excess_sigma_m,by_chance`, the last by shares_by_chance().
[[nodiscard]] std::string to_csv(const SlipReport& report, const Robot& robot);
/// Travel of all slips that was no motion, whichever way, beyond what noise makes of it, and its 1σ [m].
struct LostTravel {
  double m = 0.0;
  double sigma_m = 0.0;
};
[[nodiscard]] LostTravel lost_travel(std::span<const SlipEvent> events);
[[nodiscard]] std::string name_of(SlipKind kind);
[[nodiscard]] std::string name_of(SlipStatus status);
/// Of the wheel of an event; "ambiguous".
[[nodiscard]] std::string wheel_of(const SlipEvent& event, const Robot& robot);

}  // namespace trundle::slip
