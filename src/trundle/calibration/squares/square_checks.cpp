#include "trundle/calibration/squares/square_checks.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "trundle/io/error.hpp"

namespace trundle::calibration {
namespace {

/// Headings beyond this may have been wrapped by whoever wrote them down.
constexpr double kSuspiciousHeading = radians(150.0);
/// The classical method takes sines for angles; beyond this it is off by more than the runs scatter.
constexpr double kSmallAngle = radians(10.0);

struct Range {
  double low = 0.0;
  double high = 0.0;
};

Range headings_of(const SquareSheet& sheet, Turn turn) {
  Range range = {2e9, -2e9};
  for (const SquareRun& run : sheet.runs) {
    if (run.turn != turn) continue;
    range.low = std::min(range.low, run.error.heading);
    range.high = std::max(range.high, run.error.heading);
  }
  return range;
}

void warn_of_wrapping(const SquareSheet& sheet, std::vector<std::string>& warnings) {
  const auto suspicious = [](const SquareRun& run) {
    return std::abs(run.error.heading) > kSuspiciousHeading;
  };
  const auto count = std::ranges::count_if(sheet.runs, suspicious);
  if (count == 0) return;
  const auto first = std::ranges::find_if(sheet.runs, suspicious);
  warnings.push_back(fmt::format(
      "{}: a heading error of {:.1f} degrees ({} such): it may have been wrapped; it is taken as written",
      first->name, degrees(first->error.heading), count));
}

void warn_of_few(const SquareStatistics& statistics, std::vector<std::string>& warnings) {
  if (statistics.degrees_of_freedom == 0)
    warnings.push_back(
        fmt::format("one run of each sense shows no scatter: 1σ of {:.0f} % of the side and {:.0f}° per "
                    "run is assumed; drive five runs each way",
                    100.0 * kAssumedPositionSigmaInSides, degrees(kAssumedHeadingSigmaRad)));
  if (statistics.legs == 1)
    warnings.push_back(fmt::format("one measured leg shows no scatter: 1σ of {:.0f} mm is assumed for it",
                                   1e3 * kAssumedLegSigmaM));
}

/// Ten times the digits that anybody writes down.
constexpr double kNoScatter = 1e-8;

void warn_of_no_scatter(const SquareStatistics& statistics, std::vector<std::string>& warnings) {
  if (statistics.degrees_of_freedom > 0 &&
      statistics.covariance.topLeftCorner<6, 6>().diagonal().maxCoeff() < kNoScatter * kNoScatter)
    warnings.push_back(
        "the runs do not scatter at all: the sigmas, which come from their scatter, say nothing");
}

void warn_of_large_angles(const SquareMeans& means, double side_m, std::vector<std::string>& warnings) {
  const double alpha = (means.cw.x + means.ccw.x) / (-4.0 * side_m);
  const double beta = (means.cw.x - means.ccw.x) / (-4.0 * side_m);
  if (std::max(std::abs(alpha), std::abs(beta)) > kSmallAngle)
    warnings.push_back(
        fmt::format("classic assumes small angles; here quarter turns are off by {:.1f}° and legs bend "
                    "by {:.1f}°: use orientation or ml",
                    degrees(alpha), degrees(beta)));
}

void warn_of_unused_revolutions(const SquareMeans& means, SquareMethod method,
                                std::vector<std::string>& warnings) {
  if (!means.left_revolutions) return;
  if (method == SquareMethod::orientation && means.leg_m) return;
  warnings.push_back("revolutions count turns, not metres: they are used with leg_m and by orientation only");
}

}  // namespace

void refuse_wrapped(const SquareSheet& sheet) {
  for (const Turn turn : {Turn::cw, Turn::ccw}) {
    const Range range = headings_of(sheet, turn);
    if (range.high - range.low > kPi)
      throw CannotAnswer(
          fmt::format("{}: headings of the {} runs scatter across ±180 degrees ({:.1f} to {:.1f}): some have "
                      "been wrapped; write "
                      "every heading error as it is, up to ±540",
                      sheet.name, name_of(turn), degrees(range.low), degrees(range.high)));
  }
}

void refuse_scatter(const SquareSheet& sheet, const SquareFit& fit, const SidedDrive& nominal) {
  const Vector3 difference(-1.0, 1.0, 0.0);
  const double difference_sigma = std::sqrt(difference.dot(fit.covariance * difference));
  const double track_sigma = std::sqrt(fit.covariance(2, 2));
  if (difference_sigma > kDiameterPriorShare * nominal.mean_diameter_m() * std::sqrt(2.0) ||
      track_sigma > kTrackPriorShare * nominal.track_m)
    throw CannotAnswer(
        fmt::format("{}: the runs scatter too much: the track would be known to ±{:.2g} m and the difference "
                    "of the diameters to "
                    "±{:.2g} m (1σ), which is less than is known beforehand; drive more runs each way",
                    sheet.name, track_sigma, difference_sigma));
}

std::vector<std::string> warnings_of(const SquareSheet& sheet, const SquareStatistics& statistics,
                                     SquareMethod method) {
  std::vector<std::string> warnings;
  warn_of_wrapping(sheet, warnings);
  warn_of_few(statistics, warnings);
  warn_of_no_scatter(statistics, warnings);
  warn_of_unused_revolutions(statistics.means, method, warnings);
  if (method == SquareMethod::classic) warn_of_large_angles(statistics.means, sheet.side_m, warnings);
  return warnings;
}

}  // namespace trundle::calibration
