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

/// The slips of a recording, and its readings corrected for them.
struct SlipReport {
  std::vector<SlipEvent> events;
  SlipCounts counts;
  std::vector<SlipInterval> intervals;
  std::optional<Band> band;   ///< δ raises an alarm outside it
  double chi2_limit = 0.0;    ///< else χ² does beyond this
  AlignedReadings corrected;  ///< ready for integrate()
  Pose2 end;                  ///< the pose reached, from the origin
  std::vector<Finding> findings;
};

/// A loop over SlipOdometer::step, which learns the gyro's bias where the robot rests. `commands` may be
/// empty. Throws as the SlipOdometer does, and CannotAnswer where the robot moves but no interval can be
/// judged.
[[nodiscard]] SlipReport find_slip(AlignedReadings readings, const VelocityStream& commands,
                                   const Robot& robot, const SlipOptions& options = {});

/// What the readings are judged by, interval by interval: for learning from a recording without slip.
[[nodiscard]] std::vector<JudgedInterval> clean_intervals(const AlignedReadings& readings, const Robot& robot,
                                                          double interval_s);

/// `start_s,end_s,wheel,kind,excess_m,confidence,excess_sigma_m`
[[nodiscard]] std::string to_csv(const std::vector<SlipEvent>& events, const Robot& robot);
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
