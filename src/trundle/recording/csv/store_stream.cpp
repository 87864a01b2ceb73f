#include "trundle/recording/csv/detail/store_stream.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "trundle/io/error.hpp"
#include "trundle/recording/csv/detail/misreadings.hpp"
#include "trundle/recording/csv/detail/quaternion.hpp"
#include "trundle/recording/detail/local_frame.hpp"

namespace trundle::recording {
namespace {

void make_continuous(std::vector<double>& heading) {
  double previous = kNotMeasured;
  for (double& angle : heading) {
    if (std::isnan(angle)) continue;
    // A whole number of turns, so that a heading that is continuous already keeps all its bits.
    if (!std::isnan(previous)) angle -= 2.0 * kPi * std::round((angle - previous) / (2.0 * kPi));
    previous = angle;
  }
}

bool is_missing(double number) {
  return std::isnan(number);
}

bool are_missing(const std::vector<double>& column) {
  return std::ranges::all_of(column, is_missing);
}

void store_wheels(const StreamSource& source, Table table, Recording& recording) {
  WheelStream& wheels = recording.wheels;
  wheels.time_s = std::move(table.time_s);
  for (std::size_t i = 0; i < source.columns.size(); ++i) {
    const WheelColumn column = *wheel_column(source.columns[i].column);
    (column.is_steering ? wheels.steering : wheels.series)
        .push_back({column.wheel, column.unit, std::move(table.numbers[i])});
  }
  wheels.origin = std::move(table.origin);
  check_increments(wheels, source, recording.findings);
}

/// Range and bearing, where a file has places in the sensor's frame instead: x forward, y to the left.
void take_places(Table& sightings) {
  constexpr std::size_t kRange = 1, kBearing = 2, kX = 3, kY = 4;  // columns
  if (sightings.numbers.size() <= kY) return;
  for (const std::size_t column : {kRange, kBearing})
    if (!are_missing(sightings.numbers[column])) return;
  for (std::size_t row = 0; row < sightings.time_s.size(); ++row) {
    const double x = sightings.numbers[kX][row], y = sightings.numbers[kY][row];
    sightings.numbers[kRange][row] = std::hypot(x, y);
    sightings.numbers[kBearing][row] = std::atan2(y, x);
  }
}

void store_sightings(const StreamSource& source, Table table, Recording& recording) {
  take_places(table);
  Finding unusable{.code = FindingCode::sighting_without_number, .place = {}, .count = 0};
  for (std::size_t row = 0; row < table.time_s.size(); ++row) {
    const Sighting sighting{table.time_s[row], table.texts[0][row], table.numbers[1][row],
                            table.numbers[2][row]};
    if (sighting.range_m >= 0.0 && !std::isnan(sighting.bearing_rad)) {
      recording.sightings.push_back(sighting);
    } else if (unusable.count++ == 0) {
      unusable.place = table.origin.place_of(row);
    }
  }
  if (unusable.count > 0) recording.findings.push_back(unusable);
  check_bearings(recording.sightings, source, recording.findings);
}

VelocityStream velocity_of(Table table) {
  return {std::move(table.time_s), std::move(table.numbers[0]), std::move(table.numbers[1]),
          std::move(table.origin)};
}

/// Where there is no heading, that of a quaternion as ROS writes it: yaw, and of a robot in the plane all.
void take_quaternions(Table& reference) {
  std::vector<double>& heading = reference.numbers[2];
  if (!are_missing(heading)) return;
  for (std::size_t row = 0; row < heading.size(); ++row) {
    const auto part = [&](std::size_t column) { return reference.numbers[column][row]; };
    const auto part_or_none = [&](std::size_t column) {
      return is_missing(part(column)) ? 0.0 : part(column);
    };
    const Quaternion q{part_or_none(3), part_or_none(4), part(5), part(6)};
    if (q.length2() > 0.0) heading[row] = yaw_of(q);
  }
}

/// Where there is no position, that of latitudes and longitudes.
void take_latitudes(Table& reference) {
  constexpr std::size_t kLatitude = 7, kLongitude = 8;  // columns
  if (reference.numbers.size() <= kLongitude) return;
  if (!are_missing(reference.numbers[0]) || !are_missing(reference.numbers[1])) return;
  std::optional<LocalFrame> frame;  // at the first fix
  for (std::size_t row = 0; row < reference.time_s.size(); ++row) {
    const double latitude = reference.numbers[kLatitude][row], longitude = reference.numbers[kLongitude][row];
    if (is_missing(latitude) || is_missing(longitude)) continue;
    if (!frame) frame.emplace(latitude, longitude);
    const Vector2 position = frame->position_of(latitude, longitude);
    reference.numbers[0][row] = position.x();
    reference.numbers[1][row] = position.y();
  }
}

void store_reference(const StreamSource& source, Table table, Recording& recording) {
  check_headings(table.numbers[2], source, recording.findings);
  take_latitudes(table);
  take_quaternions(table);
  make_continuous(table.numbers[2]);
  recording.reference = {std::move(table.time_s), std::move(table.numbers[0]), std::move(table.numbers[1]),
                         std::move(table.numbers[2]), std::move(table.origin)};
}

/// What the two wheels of a differential drive must have rolled between the poses that its controller
/// computed of them: along each step an arc of constant curvature, ds ∓ dθ b/2.
void store_rebuilt_wheels(const StreamSource& source, Table table, Recording& recording) {
  take_quaternions(table);
  const std::vector<double>& x = table.numbers[0];
  const std::vector<double>& y = table.numbers[1];
  std::vector<double>& heading = table.numbers[2];
  make_continuous(heading);
  const RebuiltWheels& rebuilt = *source.rebuilt;
  std::vector<double> left(x.size(), kNotMeasured), right(x.size(), kNotMeasured);
  double left_m = 0.0, right_m = 0.0;
  std::optional<std::size_t> before;
  for (std::size_t row = 0; row < x.size(); ++row) {
    if (!std::isfinite(x[row] + y[row] + heading[row])) continue;
    if (before) {
      const double turn = heading[row] - heading[*before];
      const double middle = heading[*before] + 0.5 * turn;
      const double chord =
          (x[row] - x[*before]) * std::cos(middle) + (y[row] - y[*before]) * std::sin(middle);
      const double half = 0.5 * turn;
      const double arc = half == 0.0 ? chord : chord * half / std::sin(half);
      left_m += arc - half * rebuilt.separation_m;
      right_m += arc + half * rebuilt.separation_m;
    }
    left[row] = left_m;
    right[row] = right_m;
    before = row;
  }
  recording.wheels = {std::move(table.time_s),
                      {{rebuilt.left, WheelUnit::metres, std::move(left)},
                       {rebuilt.right, WheelUnit::metres, std::move(right)}},
                      {},
                      std::move(table.origin)};
  recording.findings.push_back({Severity::note,
                                FindingCode::rebuilt_wheels,
                                recording.wheels.origin.file,
                                x.size(),
                                {rebuilt.left, rebuilt.right},
                                payload::Amount{rebuilt.separation_m}});
}

void store_relative_motions(Table table, Recording& recording) {
  for (std::size_t row = 0; row < table.time_s.size(); ++row) {
    const Pose2 motion{table.numbers[1][row], table.numbers[2][row], table.numbers[3][row]};
    if (!std::isfinite(motion.x + motion.y + motion.heading))
      throw InputError(table.origin.place_of(row), "has no number in dx_m, dy_m or dheading_rad",
                       "all three; leave out the row of a motion that was not measured");
    recording.relative_motions.push_back({table.time_s[row], table.numbers[0][row], motion});
  }
}

/// The rates of angles: the turn from one that is known to the next, spread over the time between. Up to the
/// first there is none.
void take_differences(const std::vector<double>& time_s, std::vector<double>& angles) {
  make_continuous(angles);
  std::optional<std::size_t> known;
  double before = kNotMeasured;
  for (std::size_t row = 0; row < angles.size(); ++row) {
    if (is_missing(angles[row])) continue;
    const double turn = angles[row] - std::exchange(before, angles[row]);
    const std::size_t first = known ? *known + 1 : 0;
    const double rate = known ? turn / (time_s[row] - time_s[*known]) : kNotMeasured;
    std::fill(angles.begin() + static_cast<std::ptrdiff_t>(first),
              angles.begin() + static_cast<std::ptrdiff_t>(row) + 1, rate);
    known = row;
  }
}

void store_gyro(const StreamSource& source, Table table, Recording& recording) {
  if (source.columns[0].column == kYawAngle) take_differences(table.time_s, table.numbers[0]);
  recording.gyro = {std::move(table.time_s), std::move(table.numbers[0]), std::move(table.origin)};
}

}  // namespace

void store_stream(StreamKind kind, const StreamSource& source, Table table, Recording& recording) {
  switch (kind) {
    case StreamKind::wheels:
      return source.rebuilt ? store_rebuilt_wheels(source, std::move(table), recording)
                            : store_wheels(source, std::move(table), recording);
    case StreamKind::gyro:
      return store_gyro(source, std::move(table), recording);
    case StreamKind::commands:
      recording.commands = velocity_of(std::move(table));
      return;
    case StreamKind::velocity:
      recording.velocity = velocity_of(std::move(table));
      return;
    case StreamKind::accel:
      recording.accel = {std::move(table.time_s), std::move(table.numbers[0]), std::move(table.numbers[1])};
      return;
    case StreamKind::sightings:
      return store_sightings(source, std::move(table), recording);
    case StreamKind::reference:
      return store_reference(source, std::move(table), recording);
    case StreamKind::relative_motion:
      return store_relative_motions(std::move(table), recording);
    case StreamKind::landmarks:
      return;
  }
}

}  // namespace trundle::recording
