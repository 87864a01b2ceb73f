#include "trundle/pipeline/sensor_clock.hpp"

#include "trundle/inspection/clocks.hpp"

namespace trundle::pipeline {

std::vector<Finding> sensor_clock_checks(const Recording& recording, const AlignedReadings& readings,
                                         const Robot& robot) {
  std::optional<Finding> problem = inspection::compare_sighting_clock(recording, readings, robot).problem;
  if (!problem) return {};
  problem->severity = Severity::warning;  // info only looks
  return {*std::move(problem)};
}

}  // namespace trundle::pipeline
