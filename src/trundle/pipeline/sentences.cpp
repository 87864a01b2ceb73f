#include "trundle/pipeline/sentences.hpp"

#include <cmath>

#include <fmt/format.h>

#include "trundle/geometry/gaussian.hpp"
#include "trundle/io/words.hpp"
#include "trundle/statistics/median.hpp"

namespace trundle::pipeline {
namespace {

/// 1σ of position, root of both axes' variances together: the median over all.
std::string median_sigma_of(std::vector<double> sigmas_m) {
  if (sigmas_m.empty()) return {};
  return fmt::format(", median 1 σ {:.3f} m", median(std::move(sigmas_m)));
}

}  // namespace

std::string sentence_of(const IntegratedOdometry& odometry) {
  const Matrix3& end = odometry.end_covariance;
  return fmt::format("{:.2f} m in {:.1f} s; at the end ± {:.3f} m and ± {:.2f}°", odometry.path_length_m,
                     odometry.end.time_s - odometry.start_s, position_sigma(end),
                     degrees(std::sqrt(end(2, 2))));
}

std::string sentence_of(const SlipAnswer& answer, const IntegratedOdometry& corrected) {
  const SlipReport& report = answer.report;
  if (report.events.empty())
    return fmt::format("no slip in {}", counted(report.counts.judged, "moving interval"));
  const std::vector<SlipEvent> clear = clear_slips(report);
  const std::string found = counted(report.events.size(), "slip");
  const std::string end =
      fmt::format("corrected, at the end ± {:.3f} m", position_sigma(corrected.end_covariance));
  if (clear.empty())
    return fmt::format("no clear slip; {} in {}, where noise alone makes about {:.{}f}; {}", found,
                       counted(report.counts.judged, "moving interval"), report.counts.by_chance,
                       report.counts.by_chance < 10.0 ? 1 : 0, end);
  const LostTravel lost = lost_travel(clear);
  return fmt::format(
      "{}{}, slip distance {:.3f} ± {:.3f} m; {}", found,
      clear.size() < report.events.size() ? fmt::format(", {} of them clear", clear.size()) : "", lost.m,
      lost.sigma_m, end);
}

std::string unobservable_slip(const Robot& robot) {
  return robot.calibration
             ? "slip that lasts through the runs of the calibration, or that all wheels share, is not "
               "observable: it passes for the wheels' diameters and the track"
             : "slip that all wheels share is not observable: it passes for motion";
}

std::string sentence_of(const LocalizeAnswer& answer) {
  const auto& stretches = answer.result.stretches;
  double known_s = 0.0;
  for (const KnownStretch& stretch : stretches) known_s += stretch.end_s - stretch.start_s;
  std::vector<double> sigmas_m;
  for (const Matrix3& covariance : answer.result.trajectory.covariances)
    sigmas_m.push_back(position_sigma(covariance));
  return fmt::format("on a map of {}: localized {:.2f} s after the start, for {:.1f} s {}{}",
                     counted(answer.landmarks, "landmark"), stretches.front().start_s - answer.input.start_s,
                     known_s,
                     stretches.size() == 1 ? "continuously" : "in " + counted(stretches.size(), "piece"),
                     median_sigma_of(std::move(sigmas_m)));
}

std::string sentence_of(const SlamAnswer& slam) {
  std::vector<double> sigmas_m;
  for (const auto& landmark : slam.map()) sigmas_m.push_back(position_sigma(landmark.covariance));
  return fmt::format("{} mapped from {}{}, {}{}", counted(slam.map().size(), "landmark"),
                     counted(slam.input.observations(), "sighting"), median_sigma_of(std::move(sigmas_m)),
                     slam.smoothed ? "smoothed" : "which leave too much open to be smoothed",
                     slam.is_doubtful() ? "; INCONSISTENT: " + describe(slam.inconsistencies.front()) : "");
}

}  // namespace trundle::pipeline
