#pragma once

#include <span>
#include <vector>

#include "trundle/chassis/robot.hpp"
#include "trundle/recording/recording.hpp"

namespace trundle {

/// What one reading summed up to, row by row of the time base; NaN where it is not known.
struct Course {
  std::vector<double> value;
  double units_per_turn = 1.0;           ///< divides differences of value into revolutions, or 1
  std::vector<std::size_t> broken = {};  ///< rows whose step from the row before was not measured, ascending
};

/// What a counter did that is no travel.
struct CounterFindings {
  std::vector<std::size_t> wraps;
  std::vector<std::size_t> resets;  ///< rows that start again near zero
  std::vector<std::size_t> jumps;   ///< rows that are elsewhere without having driven there
};

/// The course of a cumulative reading. Wraps at 2^bits are undone (0: never wraps). Steps far beyond any
/// plausible speed are no travel: landing near zero they are resets, elsewhere jumps; the travel of their
/// interval is taken from the speeds before and after, and the row is broken. Empty cells between neighbours
/// at most `longest_step_s` apart are filled by linear interpolation.
Course course_of_counter(std::span<const double> time_s, std::span<const double> count, int bits,
                         double longest_step_s, CounterFindings& findings);

/// The integral of a rate that is the mean over (t_{k−1}, t_k].
Course course_of_rate(std::span<const double> time_s, std::span<const double> rate);

/// The course of one wheel of the robot. Throws InputError when the recording has no column of the wheel, or
/// the robot lacks what turns the column into revolutions.
Course course_of_wheel(const Recording& recording, const Robot& robot, std::size_t wheel,
                       double longest_step_s, std::vector<Finding>& problems);

/// The findings of one wheel as problems with line numbers.
void report(const CounterFindings& findings, const std::string& wheel, const StreamOrigin& origin,
            std::vector<Finding>& problems);

}  // namespace trundle
