#pragma once

#include <span>
#include <vector>

#include "trundle/slam/smoothing/solver/minimise.hpp"
#include "trundle/slam/smoothing/together/robots_problem.hpp"

namespace trundle::slam {

/// Where the search ended from one start.
struct RobotsMinimum {
  Minimum minimum;
  std::size_t turned = 0;  ///< the robot that was laid elsewhere
};

/// From where all are laid, and from where each that shares too little to contradict it is turned; the lowest
/// first. Costs are right to `enough`: of equal ones that from where all are laid.
[[nodiscard]] std::vector<RobotsMinimum> minima_of(std::span<const RobotRecording> robots,
                                                   std::span<const RobotSighting> seen,
                                                   const RobotsProblem& all, Minimiser& minimiser,
                                                   const SmootherOptions& options);

/// Linearises at the lowest. Throws CannotAnswer where the frame of a robot among the others is not known
/// there, or where another minimum, which has it elsewhere, explains what was seen as well.
/// docs/theory/together.md.
void require_known_frames(std::span<const RobotRecording> robots, const RobotsProblem& all,
                          const std::vector<RobotsMinimum>& minima, Minimiser& minimiser);

}  // namespace trundle::slam
