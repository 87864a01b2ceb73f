#pragma once

#include <initializer_list>
#include <span>
#include <vector>

#include "trundle/geometry/pose2.hpp"
#include "trundle/statistics/random.hpp"

namespace trundle::simulation {

/// A piece of a path driven with constant body velocity.
struct Segment {
  Twist2 motion;            ///< over the whole segment [m, m, rad]
  double duration_s = 0.0;  ///< > 0
};

/// What the robot is meant to drive, from its start pose on. Exact: each segment is exp of its motion.
using Path = std::vector<Segment>;

enum class TurnSense { ccw, cw };

/// How fast paths are driven.
struct Pace {
  double forward_m_s = 0.2;  ///< also sideways
  double turn_rad_s = 0.6;   ///< on the spot
  double rest_s = 0.5;       ///< standing still before a turn on the spot and after it
};

Path pause(double duration_s);
/// Backwards when negative.
Path straight(double length_m, const Pace& pace = {});
/// Counter-clockwise when positive.
Path turn_on_the_spot(double angle_rad, const Pace& pace = {});
/// Four legs, four quarter turns on the spot, ending as it started (UMBmark).
Path square(double side_m, TurnSense sense, const Pace& pace = {});
/// A leg along body x, then a leg along body y without turning: for robots that can move sideways.
Path l_run(double side_m, TurnSense sense = TurnSense::ccw, const Pace& pace = {});
/// The same for robots that cannot: a leg, a quarter turn on the spot, a leg.
Path l_run_with_turn(double side_m, TurnSense sense = TurnSense::ccw, const Pace& pace = {});
Path circle(double radius_m, double turns, TurnSense sense, const Pace& pace = {});
/// A circle to the left, then one to the right.
Path figure_eight(double radius_m, const Pace& pace = {});
/// From the start pose through the points to the last one: turns on the spot, straight lines.
Path waypoints(const Pose2& start, std::span<const Vector2> points, const Pace& pace = {});

/// A random tour inside a box around the world's origin.
struct Tour {
  double length_m = 20.0;          ///< at least this long
  double box_x_m = 4.0;            ///< full width of the box along world x
  double box_y_m = 4.0;            ///< along y
  double longest_segment_m = 1.5;  ///< segments are this long at most, a fifth of it at least
  double sharpest_1_m = 1.5;       ///< curvatures are uniform within ± this [1/m]
  double pause_share = 0.1;        ///< of segments that are followed by standing still
  bool sideways = false;           ///< also moves sideways (omni and mecanum wheels)
};
/// Stays inside the box when `start` is; turns towards the middle on the spot when a wall is in the way.
Path random_tour(const Tour& tour, const Pose2& start, Random& random, const Pace& pace = {});

Path joined(std::initializer_list<Path> paths);
/// Where the path ends.
Pose2 end_of(const Path& path, const Pose2& start = {});
/// Metres driven, along the arcs.
double length_of(const Path& path);
double duration_of(const Path& path);
/// Every segment stretched in time to a whole number of sampling intervals, so that none of them mixes two
/// motions.
Path in_whole_intervals(const Path& path, double rate_hz);

}  // namespace trundle::simulation
