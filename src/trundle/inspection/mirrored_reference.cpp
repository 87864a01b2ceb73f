#include "trundle/inspection/mirrored_reference.hpp"

#include <cmath>
#include <optional>

#include "trundle/geometry/angle.hpp"
#include "trundle/statistics/paired_sums.hpp"

namespace trundle::inspection {
namespace {

constexpr double kPiece_m = 0.2;   // over which the path's direction is told
constexpr double kTurn_rad = 1.0;  // from one piece to the next: more is a turn on the spot
constexpr double kLeastMirrored_rad = 1.0;
constexpr double kAgainst = -0.7;  // correlation

struct Piece {
  double course_rad;
  double heading_rad;  ///< in the middle
};

/// How path and heading turn from one piece to the next. Twice the angles: backwards is the same as forwards
/// then.
void add_bend(const Piece& before, const Piece& now, PairedSums& bends) {
  const double course = 0.5 * wrap_angle(2.0 * (now.course_rad - before.course_rad));
  const double heading = 0.5 * wrap_angle(2.0 * (now.heading_rad - before.heading_rad));
  if (std::abs(course) <= kTurn_rad && std::abs(heading) <= kTurn_rad) bends.add(course, heading);
}

}  // namespace

bool is_mirrored(const ReferenceStream& reference) {
  PairedSums bends;
  std::optional<Piece> before;
  std::optional<std::size_t> start;
  for (std::size_t i = 0; i < reference.time_s.size(); ++i) {
    const double x = reference.x_m[i], y = reference.y_m[i], heading = reference.heading_rad[i];
    if (std::isnan(x) || std::isnan(y) || std::isnan(heading)) continue;
    if (!start) start = i;
    const double dx = x - reference.x_m[*start], dy = y - reference.y_m[*start];
    if (std::hypot(dx, dy) < kPiece_m) continue;
    const double from = reference.heading_rad[*start];
    const Piece piece{std::atan2(dy, dx), from + 0.5 * wrap_angle(heading - from)};
    if (before) add_bend(*before, piece, bends);
    before = piece;
    start = i;
  }
  return bends.lesser() > kLeastMirrored_rad && bends.correlation() < kAgainst;
}

}  // namespace trundle::inspection
