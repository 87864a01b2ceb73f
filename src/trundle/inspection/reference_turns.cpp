#include "trundle/inspection/reference_turns.hpp"

#include <cmath>
#include <utility>

#include "trundle/recording/alignment/align.hpp"

namespace trundle::inspection {

PairedSums turns_of_reference(const ReferenceStream& reference, const AlignedReadings& readings,
                              const Robot& robot) {
  const auto heading_at = [&](double time_s) { return sample_reference(reference, time_s).value.z(); };
  double before = heading_at(readings.start_s);
  return turn_pairs(robot, readings, [&](const Increment& increment) {
    const double now = heading_at(increment.time_s);
    return now - std::exchange(before, now);
  });
}

std::optional<PairedSums> turns_beside(const Recording& recording, const Robot& robot,
                                       const PairedSums& by_gyro) {
  constexpr double kSeenTurning_rad = 0.5;  // root of the sum of squares: far more than a bias sums up to
  if (std::sqrt(by_gyro.yy) > kSeenTurning_rad) return by_gyro;
  if (recording.reference.time_s.size() < 2) return std::nullopt;
  const PairedSums pairs = turns_of_reference(recording.reference, align(recording, robot), robot);
  return std::sqrt(pairs.yy) > kSeenTurning_rad ? std::optional(pairs) : std::nullopt;
}

}  // namespace trundle::inspection
