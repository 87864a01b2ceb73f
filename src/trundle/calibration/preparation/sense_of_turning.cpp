#include "trundle/calibration/preparation/sense_of_turning.hpp"

#include <vector>

#include "trundle/chassis/rows.hpp"
#include "trundle/geometry/rigid_motion.hpp"

namespace trundle::calibration {
namespace {

// Of a piece of the path: two seconds show its bend, and wheels that scrub have not yet turned far too much.
constexpr std::size_t kEpochsOfAPiece = 3;
// Two minutes: beyond, a robot that is not calibrated has lost its way.
constexpr std::size_t kMostEpochsOfAPiece = 129;
// Of what the mirrored path leaves: half its size, squared.
constexpr double kMuchLess = 0.25;

/// Squared distances from the reference's positions that the best rigid motion of a path leaves.
struct Left {
  double as_is = 0.0;
  double mirrored = 0.0;

  void operator+=(const Left& more) {
    as_is += more.as_is;
    mirrored += more.mirrored;
  }
};

double left_by(const std::vector<PointPair>& pairs) {
  const auto motion = rigid_motion(pairs);
  if (!motion) return 0.0;
  double sum = 0.0;
  for (const PointPair& pair : pairs)
    sum += (pair.to - motion->translation() - rotation(motion->heading) * pair.from).squaredNorm();
  return sum;
}

Left left_of_piece(const Run& run, std::size_t first, std::size_t epochs, const Robot& robot,
                   const Rows& rows) {
  Pose2 body;
  std::vector<PointPair> as_is, mirrored;
  std::size_t done = run.epochs[first];
  for (std::size_t epoch = first; epoch < first + epochs; ++epoch) {
    for (; done < run.epochs[epoch]; ++done)
      body = body * exp(twist_of(robot.chassis, rows, run.readings.increments[done]));
    const ReferenceSample seen =
        sample_reference(run.reference, run.epoch_time(epoch) - robot.reference_time_offset_s);
    if (!seen.has_position()) return {};
    const Pose2 other{body.x, -body.y, -body.heading};
    const Vector2 to = seen.value.head<2>();
    as_is.push_back({(body * robot.body_from_reference).translation(), to});
    mirrored.push_back({(other * robot.body_from_reference).translation(), to});
  }
  return {left_by(as_is), left_by(mirrored)};
}

/// Over all pieces of so many epochs.
Left left_of(std::span<const Run> runs, std::size_t epochs, const Robot& robot) {
  const Rows rows = rows_of(robot.chassis, false);
  Left left;
  if (observability(rows).rank < 3) return left;
  for (const Run& run : runs)
    for (std::size_t first = 0; first + epochs <= run.epochs.size(); first += epochs - 1)
      left += left_of_piece(run, first, epochs, robot, rows);
  return left;
}

}  // namespace

bool positions_bend_as_wheels_turn(std::span<const Run> runs, const Robot& robot) {
  const Left left = left_of(runs, kEpochsOfAPiece, robot);
  return left.as_is < kMuchLess * left.mirrored;
}

// A turn on the spot bends only what reaches from a leg to the next: pieces are doubled until they show it.
bool positions_bend_against_wheels(std::span<const Run> runs, const Robot& robot) {
  for (std::size_t epochs = kEpochsOfAPiece; epochs <= kMostEpochsOfAPiece; epochs = 2 * epochs - 1) {
    const Left left = left_of(runs, epochs, robot);
    if (left.as_is < kMuchLess * left.mirrored) return false;
    if (left.mirrored < kMuchLess * left.as_is) return true;
  }
  return false;
}

}  // namespace trundle::calibration
