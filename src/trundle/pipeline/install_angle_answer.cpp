#include "trundle/pipeline/install_angle_answer.hpp"

#include <nlohmann/json.hpp>

#include "trundle/recording/recording.hpp"

namespace trundle::pipeline {

LinesDriven lines_driven(const std::vector<std::string>& recordings, const std::string& robot) {
  LinesDriven input;
  for (const std::string& folder : recordings) {
    for (const auto& path : recordings_below(folder)) {
      const Recording recording = read_recording(path);
      input.runs.push_back(l_run_of(recording, read_robot(robot)));
      input.files.insert(input.files.end(), recording.inputs.begin(), recording.inputs.end());
    }
  }
  input.files.push_back(input_file(robot));
  return input;
}

namespace {
using Json = nlohmann::ordered_json;
}  // namespace

Json document_of(const InstallAngleAnswer& answer) {
  const InstallAngle& angle = answer.angle;
  Json document = to_json(answer.provenance);
  document["alpha_rad"] = angle.alpha_rad;
  document["alpha_deg"] = degrees(angle.alpha_rad);
  document["theta_rad"] = angle.theta_rad;
  document["theta_deg"] = degrees(angle.theta_rad);
  document["sigma_alpha_rad"] = angle.sigma_rad;
  document["sigma_alpha_deg"] = degrees(angle.sigma_rad);
  document["x_over_s"] = angle.scale;
  document["x_over_s_sigma"] = angle.scale_sigma;
  document["sigma_from"] = angle.sigma_from_scatter ? "scatter of the runs" : "measuring sigmas";
  document["scatter_deg"] = angle.scatter_rad ? Json(degrees(*angle.scatter_rad)) : Json();
  document["scatter_degrees_of_freedom"] = angle.scatter_freedom;
  document["measuring_deg"] = degrees(angle.measuring_rad);
  document["pod1_over_pod2"] = angle.between_senses_rad ? Json(1.0 + *angle.between_senses_rad) : Json();
  document["runs"] = Json::array();
  for (std::size_t i = 0; i < answer.runs.size(); ++i) {
    const LRun& run = answer.runs[i];
    document["runs"].push_back({{"side_m", run.side_m},
                                {"end_x_m", run.end_x_m},
                                {"end_y_m", run.end_y_m},
                                {"mirrored", run.mirrored()},
                                {"alpha_deg", degrees(angle.run_alpha_rad[i])}});
  }
  document["warnings"] = angle.warnings;
  return document;
}

}  // namespace trundle::pipeline
