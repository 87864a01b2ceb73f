#include "trundle/evaluation/evaluate.hpp"

#include <filesystem>

#include <fmt/format.h>

#include "trundle/recording/increments.hpp"

#include "command.hpp"

namespace trundle::app {
namespace {

struct Options {
  Common common;
  std::string estimate;
  std::string reference;
  std::string alignment = "start";
  double longest_gap_s = EvaluateOptions{}.longest_gap_s;
  std::optional<std::string> robot;
};

Alignment alignment_named(const std::string& name) {
  if (name == "none") return Alignment::none;
  return name == "se2" ? Alignment::se2 : Alignment::start;
}

/// A trajectory and the file that it came from.
struct Input {
  Trajectory trajectory;
  InputFile file;
};

Input read_input(const std::filesystem::path& path) {
  if (!std::filesystem::is_directory(path)) return {read_trajectory(path), input_file(path)};
  const Recording recording = read_recording(path);
  Input input{reference_trajectory(recording), {}};
  if (input.trajectory.poses.empty()) input.trajectory = positions_of(recording.reference);
  if (input.trajectory.poses.empty())
    throw InputError(path.string(), "the recording holds no reference position", "a reference with x and y");
  const auto file = path / "reference.csv";
  input.file = std::filesystem::exists(file) ? input_file(file) : InputFile{path.string(), ""};
  return input;
}

nlohmann::ordered_json json_of(const RelativePoseError& error) {
  nlohmann::ordered_json json = {{"distance_m", error.distance_m}, {"pairs", error.pairs}};
  if (error.pairs == 0) return json;
  json["translation_rms_m"] = error.translation_rms_m;
  json["translation_mean_percent"] = error.translation_mean_percent;
  json["heading_rms_deg"] = degrees(error.heading_rms_rad);
  return json;
}

nlohmann::ordered_json json_of(const Nees& nees) {
  return {{"degrees_of_freedom", nees.degrees_of_freedom},
          {"mean", nees.mean},
          {"bound_95", nees.bound_95},
          {"share_inside_95", nees.share_inside_95},
          {"poses", nees.poses},
          {"without_covariance", nees.without_covariance}};
}

nlohmann::ordered_json json_of(const Evaluation& e) {
  const Pose2& T = e.reference_from_estimate;
  nlohmann::ordered_json json;
  json["alignment"] = {
      {"kind", name_of(e.alignment)}, {"x_m", T.x}, {"y_m", T.y}, {"heading_deg", degrees(T.heading)}};
  json["overlap"] = {{"first_s", e.first_s},
                     {"last_s", e.last_s},
                     {"duration_s", e.overlap_s()},
                     {"compared", e.compared},
                     {"estimate_poses", e.estimate_poses},
                     {"reference_poses", e.reference_poses}};
  json["path_m"] = e.path_m;
  json["position_m"] = {{"rms", e.position_m.rms},
                        {"mean", e.position_m.mean},
                        {"median", e.position_m.median},
                        {"max", e.position_m.max}};
  if (e.heading_rms_rad) json["heading_rms_deg"] = degrees(*e.heading_rms_rad);
  json["final"] = {{"position_m", e.final_position_m}};
  if (e.final_percent) json["final"]["percent_of_path"] = *e.final_percent;
  if (e.final_heading_rad) json["final"]["heading_deg"] = degrees(*e.final_heading_rad);
  json["relative"] = nlohmann::ordered_json::array();
  for (const RelativePoseError& error : e.relative) json["relative"].push_back(json_of(error));
  if (e.nees) json["nees"] = json_of(*e.nees);
  return json;
}

std::string text_of(const RelativePoseError& error) {
  if (error.pairs == 0) return fmt::format("  {:>5g} m   the path is too short\n", error.distance_m);
  return fmt::format("  {:>5g} m   {:.4f} m rms   {:.3f} % mean   {:.3f} deg rms   {} pairs\n",
                     error.distance_m, error.translation_rms_m, error.translation_mean_percent,
                     degrees(error.heading_rms_rad), error.pairs);
}

std::string text_of(const Nees& nees) {
  return fmt::format("NEES            {:.2f} mean (honest: {}), {:.1f} % of {} poses inside 95 %\n",
                     nees.mean, nees.degrees_of_freedom, 100.0 * nees.share_inside_95, nees.poses);
}

std::string text_of(const Evaluation& e) {
  std::string text = fmt::format(
      "Compared        {} poses over {:.1f} s, {:.2f} m; alignment {}\n"
      "Position error  {:.4f} m rms, {:.4f} mean, {:.4f} median, {:.4f} max\n",
      e.compared, e.overlap_s(), e.path_m, name_of(e.alignment), e.position_m.rms, e.position_m.mean,
      e.position_m.median, e.position_m.max);
  if (e.heading_rms_rad) text += fmt::format("Heading error   {:.3f} deg rms\n", degrees(*e.heading_rms_rad));
  text += fmt::format("At the end      {:.4f} m", e.final_position_m);
  if (e.final_percent) text += fmt::format(", {:.3f} % of the path", *e.final_percent);
  if (e.final_heading_rad) text += fmt::format(", {:.3f} deg", degrees(*e.final_heading_rad));
  text += '\n';
  if (!e.relative.empty()) text += "Relative error over\n";
  for (const RelativePoseError& error : e.relative) text += text_of(error);
  if (e.nees) text += text_of(*e.nees);
  return text;
}

void run(const Options& options) {
  Input estimate = read_input(options.estimate);
  const Input reference = read_input(options.reference);
  Provenance provenance{
      .inputs = {estimate.file, reference.file},
      .options = {{"align", options.alignment}, {"longest_gap_s", fmt::format("{}", options.longest_gap_s)}},
      .seed = std::nullopt};
  if (options.robot) {
    estimate.trajectory = of_reference_sensor(estimate.trajectory, read_robot(*options.robot));
    provenance.inputs.push_back(input_file(*options.robot));
  }
  const Evaluation evaluation =
      evaluate(estimate.trajectory, reference.trajectory,
               {.alignment = alignment_named(options.alignment), .longest_gap_s = options.longest_gap_s});
  auto document = to_json(provenance);
  document.update(json_of(evaluation));
  print(options.common, document, text_of(evaluation));
}

}  // namespace

void add_evaluate(CLI::App& app) {
  auto options = std::make_shared<Options>();
  CLI::App* command =
      add_command(app, "evaluate", "How far an estimated trajectory is from a reference",
                  "trundle evaluate trajectory.csv data/demo/session_03/tour --align se2", options->common);
  const std::string forms = "trajectory.csv, .tum, reference.csv, or a recording folder (its reference)";
  command->add_option("estimate", options->estimate, "The estimate: " + forms)->required();
  command->add_option("reference", options->reference, "What it is compared with: " + forms)->required();
  command
      ->add_option("--align", options->alignment,
                   "none: one frame already; start: first common poses laid on each other, heading "
                   "included; se2: least squares over all positions")
      ->check(CLI::IsMember({"none", "start", "se2"}))
      ->capture_default_str();
  command
      ->add_option("--longest-gap-s", options->longest_gap_s,
                   "The estimate is not interpolated across longer gaps [s]")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--robot", options->robot,
                      "Robot file: the estimate is its body's, the reference that of its [reference_sensor]");
  command->callback([options] { run(*options); });
}

}  // namespace trundle::app
