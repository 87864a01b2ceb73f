#include "trundle/simulation/path.hpp"

#include <algorithm>
#include <cmath>

namespace trundle::simulation {
namespace {

// A turn below this is none.
constexpr double kNoTurn_rad = 1e-12;

double sign_of(TurnSense sense) {
  return sense == TurnSense::ccw ? 1.0 : -1.0;
}

void append(Path& path, const Path& more) {
  path.insert(path.end(), more.begin(), more.end());
}

Path rested_turn(double angle_rad, const Pace& pace) {
  return joined({pause(pace.rest_s), turn_on_the_spot(angle_rad, pace), pause(pace.rest_s)});
}

bool inside(const Tour& tour, const Vector2& point) {
  return std::abs(point.x()) <= 0.5 * tour.box_x_m && std::abs(point.y()) <= 0.5 * tour.box_y_m;
}

bool stays_inside(const Tour& tour, const Pose2& start, const Twist2& motion) {
  constexpr int kChecks = 8;  // between two of them the sharpest arc of the default Tour bulges by 7 mm
  for (int i = 1; i <= kChecks; ++i) {
    const double u = static_cast<double>(i) / kChecks;
    const Pose2 there = start * exp({u * motion.dx, u * motion.dy, u * motion.dtheta});
    if (!inside(tour, there.translation())) return false;
  }
  return true;
}

/// A random arc; one that may go in any direction of the body when the robot can.
Segment random_segment(const Tour& tour, Random& random, const Pace& pace) {
  const double length = tour.longest_segment_m * random.uniform(0.2, 1.0);
  const double curvature = tour.sharpest_1_m * random.uniform(-1.0, 1.0);
  const double course = tour.sideways ? random.uniform(-kPi, kPi) : 0.0;
  return {{length * std::cos(course), length * std::sin(course), length * curvature},
          length / pace.forward_m_s};
}

/// Turns to the middle, then some way towards it.
Path back_to_the_middle(const Tour& tour, const Pose2& start, Random& random, const Pace& pace) {
  const Vector2 to_middle = start.inverse() * Vector2(0.0, 0.0);
  const double angle = std::atan2(to_middle.y(), to_middle.x());
  const double way = std::min(to_middle.norm(), tour.longest_segment_m) * random.uniform(0.3, 1.0);
  return joined({rested_turn(angle, pace), straight(way, pace)});
}

Path next_of_tour(const Tour& tour, const Pose2& start, Random& random, const Pace& pace) {
  constexpr int kTries = 10;  // in a corner most arcs lead out of the box: then towards the middle
  for (int i = 0; i < kTries; ++i) {
    const Segment segment = random_segment(tour, random, pace);
    if (!stays_inside(tour, start, segment.motion)) continue;
    const bool rests = random.uniform() < tour.pause_share;
    return rests ? joined({{segment}, pause(pace.rest_s)}) : Path{segment};
  }
  return back_to_the_middle(tour, start, random, pace);
}

}  // namespace

Path pause(double duration_s) {
  return duration_s > 0.0 ? Path{{{}, duration_s}} : Path{};
}

Path straight(double length_m, const Pace& pace) {
  if (length_m == 0.0) return {};
  return {{{length_m, 0.0, 0.0}, std::abs(length_m) / pace.forward_m_s}};
}

Path turn_on_the_spot(double angle_rad, const Pace& pace) {
  if (std::abs(angle_rad) < kNoTurn_rad) return {};
  return {{{0.0, 0.0, angle_rad}, std::abs(angle_rad) / pace.turn_rad_s}};
}

Path square(double side_m, TurnSense sense, const Pace& pace) {
  const Path leg = straight(side_m, pace);
  const Path turn = rested_turn(sign_of(sense) * 0.5 * kPi, pace);
  return joined({leg, turn, leg, turn, leg, turn, leg, turn});
}

Path l_run(double side_m, TurnSense sense, const Pace& pace) {
  const Segment sideways{{0.0, sign_of(sense) * side_m, 0.0}, side_m / pace.forward_m_s};
  return joined({straight(side_m, pace), pause(pace.rest_s), {sideways}});
}

Path l_run_with_turn(double side_m, TurnSense sense, const Pace& pace) {
  const Path leg = straight(side_m, pace);
  return joined({leg, rested_turn(sign_of(sense) * 0.5 * kPi, pace), leg});
}

Path circle(double radius_m, double turns, TurnSense sense, const Pace& pace) {
  // Quarters, so that no segment turns by more than π.
  const int quarters = std::max(1, static_cast<int>(std::ceil(4.0 * turns)));
  const double angle = 2.0 * kPi * turns / quarters;
  const Segment arc{{radius_m * angle, 0.0, sign_of(sense) * angle}, radius_m * angle / pace.forward_m_s};
  return Path(static_cast<std::size_t>(quarters), arc);
}

Path figure_eight(double radius_m, const Pace& pace) {
  return joined({circle(radius_m, 1.0, TurnSense::ccw, pace), circle(radius_m, 1.0, TurnSense::cw, pace)});
}

Path waypoints(const Pose2& start, std::span<const Vector2> points, const Pace& pace) {
  Path path;
  Pose2 pose = start;
  for (const Vector2& point : points) {
    const Vector2 way = pose.inverse() * point;
    const double angle = way.norm() == 0.0 ? 0.0 : std::atan2(way.y(), way.x());
    if (std::abs(angle) >= kNoTurn_rad) append(path, rested_turn(angle, pace));
    append(path, straight(way.norm(), pace));
    pose = {point.x(), point.y(), pose.heading + angle};
  }
  return path;
}

Path random_tour(const Tour& tour, const Pose2& start, Random& random, const Pace& pace) {
  Path path;
  Pose2 pose = start;
  for (double driven = 0.0; driven < tour.length_m;) {
    const Path next = next_of_tour(tour, pose, random, pace);
    append(path, next);
    pose = end_of(next, pose);
    driven += length_of(next);
  }
  return path;
}

Path joined(std::initializer_list<Path> paths) {
  Path all;
  for (const Path& path : paths) append(all, path);
  return all;
}

Pose2 end_of(const Path& path, const Pose2& start) {
  Pose2 pose = start;
  for (const Segment& segment : path) pose = pose * exp(segment.motion);
  return pose;
}

double length_of(const Path& path) {
  double length = 0.0;
  for (const Segment& segment : path) length += std::hypot(segment.motion.dx, segment.motion.dy);
  return length;
}

double duration_of(const Path& path) {
  double duration = 0.0;
  for (const Segment& segment : path) duration += segment.duration_s;
  return duration;
}

Path in_whole_intervals(const Path& path, double rate_hz) {
  Path stretched = path;
  for (Segment& segment : stretched) {
    const double intervals = std::ceil(segment.duration_s * rate_hz - 1e-9);
    segment.duration_s = std::max(1.0, intervals) / rate_hz;
  }
  return stretched;
}

}  // namespace trundle::simulation
