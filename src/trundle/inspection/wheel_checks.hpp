#pragma once

#include <vector>

#include "trundle/chassis/robot.hpp"
#include "trundle/inspection/overview.hpp"

namespace trundle::inspection {

/// Columns of wheels that the robot has not got, angles of wheels that stay where they are by the robot file,
/// and counts of which nothing says what a count is.
void find_wrong_columns(const Recording& recording, const Robot& robot, std::vector<Finding>& problems);

/// Wheels that roll differently in every turn cannot read alike where there is one.
void find_one_column_for_two(const Recording& recording, const Overview& overview, const Robot& robot,
                             std::vector<Finding>& problems);

/// Wheels of which no motion explains what they read, more than by any slip.
void find_contrary_wheels(const Recording& recording, const Overview& overview, const Robot& robot,
                          std::vector<Finding>& problems);

}  // namespace trundle::inspection
