#include "trundle/inspection/steering_checks.hpp"

#include "trundle/inspection/steering_direction.hpp"
#include "trundle/inspection/steering_unit.hpp"

namespace trundle::inspection {

std::optional<Finding> wrong_steering(const Recording& recording, const Robot& robot,
                                      const Overview& overview) {
  if (auto unit = wrong_steering_unit(recording, robot, overview)) return unit;
  return wrong_steering_direction(recording, robot);
}

}  // namespace trundle::inspection
