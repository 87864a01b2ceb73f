#include "trundle/calibration/preparation/steering_sense.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <optional>

#include "trundle/chassis/rows.hpp"
#include "trundle/chassis/without_wheel.hpp"
#include "trundle/geometry/angle.hpp"
#include "trundle/statistics/paired_sums.hpp"

namespace trundle::calibration {
namespace {

using Complex = std::complex<double>;

constexpr double kAgainst = -0.8;         // correlation
constexpr double kMirroredLeaves = 0.25;  // of what angles as they are read leave: half of it, squared
constexpr double kSeen = 0.01;            // of all squares: directions that are 6° apart
constexpr std::size_t kFewestPieces = 5;  // of some seconds
constexpr double kLeastTravel_m = 0.05;   // of a piece: less shows no direction
constexpr double kSteady = 0.9;           // length of a mean direction: it is steered by 25° meanwhile

/// How the body moved over a piece of a run, in its own frame, and the increments of that piece.
struct Piece {
  Vector3 motion;
  std::size_t first, end;
};

std::vector<Piece> by_reference(const Run& run, const Robot& robot) {
  std::vector<Piece> pieces;
  for (std::size_t epoch = 1; epoch < run.epochs.size(); ++epoch) {
    const auto start = body_by_reference(run, run.epochs[epoch - 1], robot);
    const auto end = body_by_reference(run, run.epochs[epoch], robot);
    if (!start || !end || std::ranges::binary_search(run.jumps, epoch)) continue;
    Pose2 moved = start->inverse() * *end;
    moved.heading = wrap_angle(moved.heading);
    pieces.push_back({log(moved).vector(), run.epochs[epoch - 1], run.epochs[epoch]});
  }
  return pieces;
}

/// By the wheels that are not steered, where they show the motion.
std::vector<Piece> by_other_wheels(const Run& run, const Robot& robot) {
  constexpr double kPiece_s = 1.0;
  std::vector<Piece> pieces;
  const std::optional<Chassis> others = without_steering(robot.chassis);
  if (!others) return pieces;
  const Rows rows = rows_of(*others, false);
  if (observability(rows).rank < 3) return pieces;
  Pose2 moved;
  double duration_s = 0.0;
  std::size_t first = 0;
  for (std::size_t i = 0; i < run.readings.increments.size(); ++i) {
    const Increment& increment = run.readings.increments[i];
    moved = moved * exp(twist_of(*others, rows, increment));
    duration_s += increment.duration_s;
    if (duration_s < kPiece_s) continue;
    pieces.push_back({log(moved).vector(), first, i + 1});
    moved = {};
    duration_s = 0.0;
    first = i + 1;
  }
  return pieces;
}

/// Where a wheel's contact point moves in a piece, seen from its direction: along it, and to its left [m].
Vector2 moved_contact(const Vector3& motion, const Wheel& wheel) {
  const Vector2 contact(motion.x() - motion.z() * wheel.y_m, motion.y() + motion.z() * wheel.x_m);
  return rotation(-wheel.direction_rad) * contact;
}

/// A direction that a wheel rolls along forwards or backwards.
Complex doubled(double angle_rad) {
  return std::polar(1.0, 2.0 * angle_rad);
}

/// What one wheel read and what it should have read, over all pieces.
class Compared {
 public:
  void add(const Run& run, const Piece& piece, const Robot& robot, std::size_t index) {
    Wheel wheel = robot.chassis.all_wheels()[index];
    const Vector2 contact = moved_contact(piece.motion, wheel);
    if (contact.norm() < kLeastTravel_m) return;
    double turned = 0.0;
    Complex rolls = 0.0, steered = 0.0;
    for (std::size_t i = piece.first; i < piece.end; ++i) {
      const Increment& increment = run.readings.increments[i];
      turned += increment.turned[index];
      if (wheel.steering) wheel.steering->reading_rad = increment.steering_rad[index];
      const double angle_rad = rolling_direction(wheel) - wheel.direction_rad;
      rolls += std::polar(1.0, angle_rad);
      steered += doubled(angle_rad);
    }
    rolls /= static_cast<double>(piece.end - piece.first);
    steered /= static_cast<double>(piece.end - piece.first);
    ++pieces_;
    travel_.add(contact.x() * rolls.real() + contact.y() * rolls.imag(), turned);
    if (std::abs(steered) < kSteady) return;
    const Complex course = doubled(std::atan2(contact.y(), contact.x()));
    as_read_ += std::conj(course) * steered;
    mirrored_ += course * steered;
    squares_ += 1.0 + std::norm(steered);
  }

  bool steers_the_other_way() const {
    return pieces_ >= kFewestPieces && left_by(as_read_) > kSeen * squares_ &&
           left_by(mirrored_) < kMirroredLeaves * left_by(as_read_);
  }
  bool turns_the_other_way() const {
    return pieces_ >= kFewestPieces && travel_.yy > 0.0 && travel_.correlation() < kAgainst;
  }

 private:
  /// Of the squares, with the zero that leaves least: nobody knows a steering's.
  double left_by(Complex sum) const { return squares_ - 2.0 * std::abs(sum); }

  std::size_t pieces_ = 0;
  Complex as_read_ = 0.0, mirrored_ = 0.0;
  double squares_ = 0.0;
  PairedSums travel_;  ///< of what it should have rolled, and of what it turned
};

}  // namespace

ReversedWheels reversed_wheels_of_steered(std::span<const Run> runs, const Robot& robot) {
  std::vector<Compared> compared(robot.chassis.all_wheels().size());
  bool have_headings = false;
  for (const Run& run : runs) have_headings = have_headings || run.reference.has_headings();
  for (const Run& run : runs)
    for (const Piece& piece : have_headings ? by_reference(run, robot) : by_other_wheels(run, robot))
      for (std::size_t i = 0; i < compared.size(); ++i) compared[i].add(run, piece, robot, i);
  ReversedWheels reversed;
  for (std::size_t i = 0; i < compared.size(); ++i) {
    if (robot.chassis.all_wheels()[i].steering && compared[i].steers_the_other_way())
      reversed.steerings.push_back(i);
    if (have_headings && i < robot.chassis.wheels().size() && compared[i].turns_the_other_way())
      reversed.counters.push_back(i);
  }
  return reversed;
}

}  // namespace trundle::calibration
