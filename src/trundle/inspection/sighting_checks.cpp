#include "trundle/inspection/sighting_checks.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <map>
#include <vector>

#include <Eigen/Core>
#include <Eigen/QR>

#include "trundle/chassis/rows.hpp"
#include "trundle/io/error.hpp"
#include "trundle/odometry/integrate.hpp"
#include "trundle/recording/csv/units.hpp"
#include "trundle/recording/detail/motion_path.hpp"

namespace trundle::inspection {
namespace {

using Complex = std::complex<double>;
using Column = Eigen::VectorXcd;

// Between two sightings of a landmark that are compared: far more than a sensor errs, little for odometry to
// drift.
constexpr double kBaseline_m = 1.0;
constexpr Eigen::Index kFewestPairs = 20;  // of three unknowns: lever and sign of the bearing
// Of the squared motion: what noise and a robot that is not calibrated leave, and a mistake does not.
constexpr double kWrong = 0.2;
// Of that misfit, the most that the mistake which explains it may leave; and no more than is wrong itself.
constexpr double kFarLess = 0.25;

/// The plane as complex numbers. A landmark at r e^{ib} in the sensor's frame stands at p + e^{iθ}(l + s r
/// e^{ib}) by a sensor at l that looks along s (|s| = 1 where ranges are metres): where it is seen twice,
/// s·seen + l·turned = moved.
struct TwiceSeen {
  Column seen;      ///< r₁ e^{i(b₁+θ₁)} − r₂ e^{i(b₂+θ₂)}
  Column mirrored;  ///< the same with bearings to the right
  Column turned;    ///< e^{iθ₁} − e^{iθ₂}
  Column moved;     ///< p₂ − p₁
};

struct Seen {
  Complex position, heading;
  double range_m = 0.0, bearing_rad = 0.0;
};

/// As odometry has it, with the gyro and the bias that it learned in the end: what wheels that are not
/// calibrated turn is off by radians before a landmark is seen again, and what a bias that is learned on the
/// way moves a pose by is no motion. Nothing where odometry cannot tell.
std::optional<MotionPath> path_of(const AlignedReadings& readings, const Robot& robot) try {
  if (observability(rows_of(robot.chassis, robot.chassis.gyro.has_value())).rank < 3) return std::nullopt;
  Robot told = robot;
  if (robot.chassis.gyro) {
    const auto keeps_none = [](std::size_t) { return false; };
    told.chassis.gyro->bias_rad_s =
        odometry::integrate(readings, robot, {.keeps = keeps_none}).end_gyro_bias.rad_s;
  }
  const odometry::IntegrateOptions plain{.with_covariance = false, .learn_gyro_bias = false};
  std::optional<MotionPath> path =
      motion_path(odometry::integrate(readings, told, plain).trajectory, INFINITY);
  if (!path) return std::nullopt;
  path->bridged = readings.bridged;
  if (observability(rows_of(robot.chassis, false)).rank < 3)
    for (std::size_t i = 0; i < path->bridged.size(); ++i)
      if (!readings.increments[i].has_gyro) path->bridged[i] = true;
  return path;
} catch (const InputError&) {
  return std::nullopt;
} catch (const CannotAnswer&) {
  return std::nullopt;
}

/// Where the path first spans a gap, or ends: beyond it poses do not hang together with those before.
double end_of_first_stretch(const MotionPath& path) {
  return path.time_s[static_cast<std::size_t>(std::ranges::find(path.bridged, true) - path.bridged.begin())];
}

/// Each sighting with the next one of the same landmark after the robot has moved on.
TwiceSeen twice_seen(const std::vector<Sighting>& sightings, const MotionPath& path, double offset_s) {
  const double start_s = path.time_s.front(), end_s = end_of_first_stretch(path);
  std::map<std::string, Seen> before;
  std::vector<std::pair<Seen, Seen>> pairs;
  for (const Sighting& sighting : sightings) {
    const double time_s = sighting.time_s + offset_s;
    if (sighting.landmark.empty() || time_s < start_s || time_s >= end_s) continue;
    const Pose2 body = path.at(time_s);
    const Seen now{{body.x, body.y}, std::polar(1.0, body.heading), sighting.range_m, sighting.bearing_rad};
    const auto [last, is_first] = before.try_emplace(sighting.landmark, now);
    if (is_first || std::abs(now.position - last->second.position) < kBaseline_m) continue;
    pairs.emplace_back(last->second, now);
    last->second = now;
  }
  const auto n = static_cast<Eigen::Index>(pairs.size());
  TwiceSeen twice{Column(n), Column(n), Column(n), Column(n)};
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto& [a, b] = pairs[static_cast<std::size_t>(i)];
    twice.seen[i] =
        std::polar(a.range_m, a.bearing_rad) * a.heading - std::polar(b.range_m, b.bearing_rad) * b.heading;
    twice.mirrored[i] =
        std::polar(a.range_m, -a.bearing_rad) * a.heading - std::polar(b.range_m, -b.bearing_rad) * b.heading;
    twice.turned[i] = a.heading - b.heading;
    twice.moved[i] = b.position - a.position;
  }
  return twice;
}

/// A mistake that would explain the sightings, and how much of the motion it leaves unexplained.
struct Explanation {
  double misfit = 0.0;
  Finding finding;
};

/// By how much longer ranges are than they should be, and the unit that explains it, if one does.
payload::LengthRatio range_ratio(double metres) {
  constexpr double kSame = 1.2;  // ranges are right to within that
  for (const auto& [unit, symbol] : kLengthUnits)
    if (const double ratio = metres / factor_of(symbol, "range_m").value();
        ratio < kSame && ratio > 1.0 / kSame)
      return {metres, unit, symbol};
  return {metres};
}

/// Each mistake alone, set as it explains most.
std::vector<Explanation> explanations(const TwiceSeen& twice, Complex lever, Complex looks) {
  const Column moved = twice.moved - lever * twice.turned;  // with the sensor where the robot file has it
  const Column seen = looks * twice.seen;
  const Complex overlap = seen.dot(moved);                                  // its first factor conjugated
  const double scale = std::max(overlap.real(), 0.0) / seen.squaredNorm();  // no range is negative
  const Complex turn = std::polar(1.0, std::arg(overlap));
  const Column rest = twice.moved - seen;
  const Complex place = twice.turned.dot(rest) / twice.turned.squaredNorm();
  return {{(moved - looks * twice.mirrored).squaredNorm(), {.code = FindingCode::bearing_unit}},
          {(moved - scale * seen).squaredNorm(),
           {.code = FindingCode::range_unit, .payload = range_ratio(scale)}},
          {(moved - turn * seen).squaredNorm(),
           {.code = FindingCode::bearing_unit, .payload = payload::Amount{degrees(std::arg(looks * turn))}}},
          {(rest - place * twice.turned).squaredNorm(),
           {.code = FindingCode::geometry, .payload = payload::Range{place.real(), place.imag()}}}};
}

}  // namespace

std::optional<Finding> wrong_sightings(const Recording& recording, const Robot& robot,
                                       const AlignedReadings& readings) {
  if (!robot.landmark_sensor || recording.sightings.empty()) return std::nullopt;
  const std::optional<MotionPath> path = path_of(readings, robot);
  if (!path) return std::nullopt;
  const Pose2& sensor = robot.landmark_sensor->body_from_sensor;
  const TwiceSeen twice = twice_seen(recording.sightings, *path, robot.landmark_sensor->time_offset_s);
  if (twice.moved.size() < kFewestPairs) return std::nullopt;
  const Complex lever(sensor.x, sensor.y), looks = std::polar(1.0, sensor.heading);
  const double misfit = (twice.moved - lever * twice.turned - looks * twice.seen).squaredNorm();
  const double wrong = kWrong * twice.moved.squaredNorm();
  if (misfit < wrong) return std::nullopt;
  std::vector<Explanation> all = explanations(twice, lever, looks);
  Explanation& best = *std::ranges::min_element(all, {}, &Explanation::misfit);
  if (!(best.misfit < std::min(kFarLess * misfit, wrong))) return std::nullopt;
  best.finding.place = "sightings";
  return std::move(best.finding);
}

}  // namespace trundle::inspection
