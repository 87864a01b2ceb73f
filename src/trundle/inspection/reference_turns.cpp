#include "trundle/inspection/reference_turns.hpp"

#include <utility>

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

}  // namespace trundle::inspection
