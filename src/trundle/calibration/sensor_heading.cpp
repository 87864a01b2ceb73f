#include "trundle/calibration/sensor_heading.hpp"

#include <algorithm>
#include <cmath>

#include "trundle/calibration/relative_likelihood.hpp"

namespace trundle::calibration {
namespace {

// Of a motion, to count as straight: a lever of half its way changes its direction by as much, and left turns
// take back what right turns do.
constexpr double kStraight_rad = 0.1;
// |Σ| over Σ| |: 1 where all directions agree, near 0 where they have nothing to do with each other.
constexpr double kAgree = 0.8;
constexpr double kFewestMotions = 10.0;  // so many unrelated directions agree by 0.8 in 1 of 2000 cases

/// The sum of sensor × body and sensor · body over straight motions.
struct Directions {
  double sine = 0.0, cosine = 0.0, length = 0.0, motions = 0.0;

  void add(const Vector2& sensor, const Vector2& body) {
    sine += sensor.x() * body.y() - sensor.y() * body.x();
    cosine += sensor.dot(body);
    length += sensor.norm() * body.norm();
    motions += 1.0;
  }
};

void add_motions(const Run& run, const Robot& robot, Directions& directions) {
  Robot in_the_middle = robot;
  in_the_middle.body_from_reference = {};
  const RelativeResiduals residuals = relative_residuals(run, in_the_middle, {});
  auto measured = run.relative_motions.begin();
  for (std::size_t i = 0; i < residuals.residual.size(); ++i) {
    while (measured->start_s != residuals.start_s[i]) ++measured;
    const Pose2& motion = measured->motion;
    if (std::abs(motion.heading) < kStraight_rad)
      directions.add(motion.translation(), motion.translation() - residuals.residual[i].head<2>());
    ++measured;
  }
}

}  // namespace

std::optional<double> sensor_heading(std::span<const Run> runs, const Robot& robot) {
  Directions directions;
  for (const Run& run : runs) add_motions(run, robot, directions);
  const bool agree = std::hypot(directions.sine, directions.cosine) > kAgree * directions.length;
  if (directions.motions < kFewestMotions || !agree) return std::nullopt;
  return std::atan2(directions.sine, directions.cosine);
}

}  // namespace trundle::calibration
