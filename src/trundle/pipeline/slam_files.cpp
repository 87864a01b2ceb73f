// What is written of a SlamAnswer: its documents and files.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "trundle/pipeline/innovations.hpp"
#include "trundle/pipeline/slam_answer.hpp"
#include "trundle/recording/landmark_file.hpp"
#include "trundle/recording/trajectory_file.hpp"
#include "trundle/report/json_text.hpp"
#include "trundle/report/or_null.hpp"
#include "trundle/slam/map_file.hpp"

namespace trundle::pipeline {
namespace {

using Json = nlohmann::ordered_json;

std::vector<std::string> names_of(const SlamAnswer& answer) {
  std::vector<std::string> names;
  for (const MappedLandmark& landmark : answer.map())
    names.push_back(answer.input.landmarks[static_cast<std::size_t>(landmark.id)]);
  return names;
}

std::vector<LandmarkRow> rows_of(const std::vector<MappedLandmark>& map,
                                 const std::vector<std::string>& names) {
  std::vector<LandmarkRow> rows;
  for (const MappedLandmark& landmark : map) {
    Matrix2 covariance = landmark.covariance;
    covariance(1, 0) = covariance(0, 1);  // the half that is written
    rows.push_back({.name = names[static_cast<std::size_t>(landmark.id)],
                    .position = landmark.position,
                    .covariance = covariance,
                    .sightings = static_cast<double>(landmark.sightings)});
  }
  return rows;
}

/// To a tenth of a millimetre: it is for a picture, and the page of a run is that of its files.
double drawn(double metres) {
  return std::round(1e4 * metres) / 1e4;
}

Vector2 drawn(const Vector2& place) {
  return {drawn(place.x()), drawn(place.y())};
}

/// Of steps with sightings; of many the one of each stretch that moved the pose most.
void add_largest_moves(const SlamAnswer& answer, GrowthResult& growth) {
  constexpr std::size_t kMostMoves = 2000;  // more than a chart has pixels across
  std::vector<std::size_t> sees;
  for (std::size_t k = 0; k < answer.input.steps.size(); ++k)
    if (!answer.input.steps[k].observations.empty()) sees.push_back(k);
  const std::size_t stretches = std::min(sees.size(), kMostMoves);
  const auto moved = [&](std::size_t k) { return answer.result.moved_m[k]; };
  for (std::size_t i = 0; i < stretches; ++i) {
    const auto first = sees.begin() + static_cast<std::ptrdiff_t>(i * sees.size() / stretches);
    const auto last = sees.begin() + static_cast<std::ptrdiff_t>((i + 1) * sees.size() / stretches);
    const std::size_t most = *std::ranges::max_element(first, last, {}, moved);
    growth.moved_time_s.push_back(answer.input.steps[most].time_s);
    growth.moved_m.push_back(drawn(moved(most)));
  }
}

std::string csv_of_steps(const SlamAnswer& answer) {
  std::string text = "time_s,sightings,effective_particles,resampled,greatest_weight\n";
  for (std::size_t k = 0; k < answer.input.steps.size(); ++k) {
    const StepReport& report = answer.result.reports[k];
    text += fmt::format("{},{},{},{},{}\n", answer.input.steps[k].time_s, report.observations.size(),
                        report.effective_particles, report.resampled ? 1 : 0, report.greatest_weight);
  }
  return text;
}

std::string csv_of_innovations(const SlamAnswer& answer) {
  std::string text = kInnovationColumns;
  for (std::size_t k = 0; k < answer.input.steps.size(); ++k)
    append_innovations(text, answer.input.steps[k], answer.result.reports[k].observations,
                       answer.input.landmarks);
  return text;
}

std::string csv_of(const std::vector<WeightedPose>& particles) {
  std::string text = "x_m,y_m,heading_rad,weight\n";
  for (const WeightedPose& particle : particles)
    text += fmt::format("{},{},{},{}\n", particle.pose.x, particle.pose.y, particle.pose.heading,
                        particle.weight);
  return text;
}

/// The gyro's, not less that of the robot file.
Json bias_of(const SlamAnswer& answer) {
  const BiasEstimate& last = answer.bias().back();
  return {{"rad_s", answer.gyro_bias_rad_s + last.rad_s},
          {"sigma_rad_s", std::sqrt(std::max(0.0, last.variance))}};
}

/// Every second; fewer rows where there would be more than kMostRows. The last one is kept.
BiasOverTime bias_over_time(const SlamAnswer& answer) {
  constexpr std::size_t kMostRows = 4000;  // more than a picture has pixels across
  BiasOverTime columns;
  const auto& steps = answer.input.steps;
  const double every_s =
      std::max(1.0, (steps.back().time_s - answer.input.start_s) / static_cast<double>(kMostRows));
  double next_s = answer.input.start_s;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    if (steps[k].time_s < next_s && k + 1 != steps.size()) continue;
    next_s = steps[k].time_s + every_s;
    columns.time_s.push_back(steps[k].time_s);
    columns.rad_s.push_back(answer.gyro_bias_rad_s + answer.bias()[k].rad_s);
    columns.sigma_rad_s.push_back(std::sqrt(std::max(0.0, answer.bias()[k].variance)));
  }
  return columns;
}

bool knows_bias(const SlamAnswer& answer) {
  return answer.input.systematic.has_bias && !answer.bias().empty();
}

}  // namespace

Json systematic_json(const SystematicErrors& errors, const PoseEstimate& last) {
  Json document = Json::array();
  for (const NamedError& error : named_errors(errors, last))
    document.push_back(
        {{"name", error.name}, {"unit", error.unit}, {"value", error.value}, {"sigma", error.sigma}});
  return document;
}

Json smoother_json(const SmootherCounts& counts) {
  return {{"poses", counts.poses},
          {"sightings", counts.sightings},
          {"outliers", counts.outliers},
          {"cost", counts.cost},
          {"degrees_of_freedom", counts.degrees_of_freedom},
          {"iterations", counts.iterations},
          {"starts", counts.starts},
          {"converged", counts.converged}};
}

Json document_of(const SlamAnswer& answer) {
  const SlamCounts& counts = answer.result.counts;
  const StampedPose& end = answer.trajectory().poses.back();
  Json document = to_json(answer.provenance);
  document["status"] = answer.is_doubtful() ? name_of(answer.inconsistencies.front().code) : "ok";
  document["doubts"] = to_json(answer.inconsistencies);
  document["steps"] = answer.input.steps.size();
  document["landmarks"] = answer.map().size();
  document["tentative_landmarks"] = answer.result.tentative.size();
  document["sightings"] = {{"matched", counts.matched},
                           {"created", counts.created},
                           {"rejected", counts.rejected},
                           {"invalid", counts.invalid}};
  document["nis"] = {
      {"mean", or_null(counts.mean_nis)}, {"median", or_null(counts.median_nis)}, {"honest_mean", 2.0}};
  document["resampled_steps"] = counts.resampled;
  document["smallest_effective_share"] = counts.smallest_effective_share;
  document["end"] = {
      {"time_s", end.time_s}, {"x_m", end.pose.x}, {"y_m", end.pose.y}, {"heading_rad", end.pose.heading}};
  document["trajectory"] = answer.smoothed ? "smoothed" : "online estimate";
  if (answer.smoothed) {
    document["online"] = "online estimate";
    document["smoother"] = smoother_json(answer.smoothed->counts);
  }
  if (answer.result.path) document["path"] = "whole path of the best particle";
  document["systematic_errors"] = systematic_json(answer.input.systematic, answer.last());
  if (answer.metre_sigma > 0.0) document["metre_sigma"] = answer.metre_sigma;
  if (knows_bias(answer)) {
    document["gyro_bias"] = bias_of(answer);
    document["gyro_bias_over_time"] = to_json(bias_over_time(answer));
    document["rest_s"] = answer.input.rest_s;
  }
  document["problems"] = to_json(answer.input.findings);
  return document;
}

SlamSummary slam_summary_of(const SlamAnswer& answer) {
  SlamSummary summary{.document = document_of(answer)};
  if (knows_bias(answer)) summary.bias = bias_over_time(answer);
  return summary;
}

std::optional<GrowthResult> growth_of(const SlamAnswer& answer) {
  if (answer.result.growth.empty()) return std::nullopt;
  GrowthResult growth;
  for (const Snapshot& snapshot : answer.result.growth) {
    growth.snapshots.push_back({.time_s = snapshot.time_s,
                                .pose = snapshot.pose,
                                .covariance = snapshot.covariance.topLeftCorner<2, 2>(),
                                .path = {},
                                .landmarks = rows_of(snapshot.map, answer.input.landmarks)});
    Matrix2& covariance = growth.snapshots.back().covariance;
    covariance(1, 0) = covariance(0, 1);  // the half that is written
    for (const StampedPose& pose : snapshot.path)
      growth.snapshots.back().path.push_back(drawn(pose.pose.translation()));
    for (LandmarkRow& landmark : growth.snapshots.back().landmarks) {
      landmark.position = drawn(landmark.position);
      landmark.sightings.reset();
    }
  }
  add_largest_moves(answer, growth);
  return growth;
}

std::vector<LandmarkRow> landmark_rows_of(const SlamAnswer& answer) {
  return rows_of(answer.map(), answer.input.landmarks);
}

std::vector<std::string> slam_file_names() {
  return {"trajectory.csv", "landmarks.csv",   "landmarks_covariance.csv",
          "steps.csv",      "innovations.csv", "slam.json",
          "growth.json",    "online.csv",      "particles.csv",
          "path.csv",       "slam.mcap",       "slam.wpilog",
          "merge.json"};
}

std::vector<OutputFile> files_of(const SlamAnswer& answer, const std::filesystem::path& folder) {
  const std::string head = head_of(answer.provenance);
  std::vector<OutputFile> files = {
      {folder / "trajectory.csv", head + to_csv(answer.trajectory())},
      {folder / "landmarks.csv", head + to_csv(answer.map(), answer.input.landmarks)},
      {folder / "steps.csv", head + csv_of_steps(answer)},
      {folder / "innovations.csv", head + csv_of_innovations(answer)},
      {folder / "slam.json", dumped(document_of(answer), 2) + "\n"}};
  if (const auto growth = growth_of(answer)) {
    Json document = to_json(answer.provenance);
    document.update(to_json(*growth));
    files.push_back({folder / "growth.json", dumped(document) + "\n"});
  }
  if (answer.smoothed) files.push_back({folder / "online.csv", head + to_csv(answer.result.online)});
  if (const Eigen::MatrixXd& covariance = answer.map_covariance(); covariance.size() > 0)
    files.push_back({covariance_file_of(folder / "landmarks.csv"),
                     head + landmark_covariance_csv(names_of(answer), covariance)});
  if (!answer.result.particles.empty())
    files.push_back({folder / "particles.csv", head + csv_of(answer.result.particles)});
  if (answer.result.path) files.push_back({folder / "path.csv", head + to_csv(*answer.result.path)});
  return files;
}

}  // namespace trundle::pipeline
