#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <pybind11/stl.h>

#include "trundle/io/error.hpp"
#include "trundle/pipeline/install_angle_answer.hpp"
#include "trundle/pipeline/umbmark_answer.hpp"

#include "binding.hpp"
#include "call.hpp"

namespace trundle::python {
namespace {

CalibrationAnswer umbmark(std::vector<std::string> inputs, const RobotFile& robot,
                          std::optional<double> side_m, const std::string& method) {
  if (inputs.empty()) throw InputError("inputs", "name no file", "one sheet, or recordings of square runs");
  if (side_m) require_from("side_m", *side_m, kSmallest, kLargest);
  const auto known = square_method_named(method);
  if (!known) throw InputError("method", fmt::format("is '{}'", method), "'classic', 'orientation' or 'ml'");
  const UmbmarkQuestion question{.inputs = std::move(inputs), .side_m = side_m, .method = *known};
  return by_library([&] { return answer_umbmark(question, robot); });
}

/// Where a run ended: x ahead and y to the left of its start [m].
using End = std::pair<double, double>;

struct InstallAngleArguments {
  std::vector<std::string> recordings;
  std::string robot;
  std::optional<double> side_m;
  std::vector<End> ends;
  double sigma_m = 0.0;
  double sigma_heading_deg = 0.0;
  bool each_run = false;
};

LinesDriven lines_of(const InstallAngleArguments& arguments) {
  if (!arguments.recordings.empty()) {
    if (arguments.side_m || !arguments.ends.empty())
      throw InputError("recordings", "hold the side and the end of each run", "no side_m and no ends");
    if (arguments.robot.empty()) throw InputError("robot", "is not given", "which wheel is which pod");
    return lines_driven(arguments.recordings, arguments.robot);
  }
  if (!arguments.side_m || arguments.ends.empty())
    throw InputError("install_angle", "is given no run", "side_m and ends, or recordings and robot");
  require_from("side_m", *arguments.side_m, 0.0, kLargest);
  LinesDriven lines;
  for (const auto& [x, y] : arguments.ends) {
    require_from("ends", x, -kLargest, kLargest);
    require_from("ends", y, -kLargest, kLargest);
    lines.runs.push_back({.side_m = *arguments.side_m, .end_x_m = x, .end_y_m = y});
  }
  return lines;
}

/// Options under the names that the program gives them.
Provenance provenance_of(const InstallAngleArguments& arguments, const LinesDriven& lines) {
  Provenance provenance{lines.files, {}, std::nullopt};
  const auto add = [&](const char* name, double value) {
    provenance.options.emplace_back(name, fmt::format("{}", value));
  };
  if (arguments.side_m) add("side_m", *arguments.side_m);
  for (const End& end : arguments.ends) add("end_x_m", end.first);
  for (const End& end : arguments.ends) add("end_y_m", end.second);
  add("sigma_m", arguments.sigma_m);
  add("sigma_heading_deg", arguments.sigma_heading_deg);
  provenance.options.emplace_back("start_heading", arguments.each_run ? "each-run" : "one-alignment");
  return provenance;
}

InstallAngleAnswer answer_install_angle(const InstallAngleArguments& arguments) {
  require_from("sigma_m", arguments.sigma_m, 0.0, kLargest);
  require_from("sigma_heading_deg", arguments.sigma_heading_deg, 0.0, 360.0);
  const LinesDriven lines = lines_of(arguments);
  const InstallAngleOptions options{
      .sigma_m = arguments.sigma_m,
      .sigma_heading_rad = radians(arguments.sigma_heading_deg),
      .start_heading = arguments.each_run ? StartHeading::each_run : StartHeading::one_alignment};
  return {provenance_of(arguments, lines), lines.runs, install_angle(lines.runs, options)};
}

void bind_install_angle(py::module_& module) {
  py::class_<InstallAngleAnswer> bound(module, "InstallAngle", "The mounting angle of two dead wheels.");
  const auto field = [&](const char* name, auto member, const char* text) {
    bound.def_property_readonly(
        name, [member](const InstallAngleAnswer& self) { return self.angle.*member; }, text);
  };
  field("alpha_rad", &InstallAngle::alpha_rad, "Mounting error of pod 1.");
  field("theta_rad", &InstallAngle::theta_rad, "Pod 1 rolls at this angle from pod 2.");
  field("sigma_rad", &InstallAngle::sigma_rad, "1 sigma of both.");
  field("scale", &InstallAngle::scale, "X/S: multiply the diameter of pod 2 by it.");
  field("scale_sigma", &InstallAngle::scale_sigma, "");
  field("run_alpha_rad", &InstallAngle::run_alpha_rad, "Of each run alone.");
  field("warnings", &InstallAngle::warnings, "");
  bound.def("__repr__", [](const InstallAngleAnswer& self) {
    return fmt::format("<InstallAngle: alpha {:.4f}° ± {:.4f}°>", degrees(self.angle.alpha_rad),
                       degrees(self.angle.sigma_rad));
  });
  const auto document = [](const InstallAngleAnswer& answer) { return document_of(answer); };
  add_document(bound, document);
  add_save_of_document(bound, document, "Writes what `trundle install-angle --json` prints.");
  add_python_methods(bound, "A DataFrame with a row for each run.");
  module.def(
      "install_angle",
      [](std::vector<std::string> recordings, std::string robot, std::optional<double> side_m,
         std::vector<End> ends, double sigma_m, double sigma_heading_deg, const std::string& start_heading) {
        if (start_heading != "one-alignment" && start_heading != "each-run")
          throw InputError("start_heading", fmt::format("is '{}'", start_heading),
                           "'one-alignment' or 'each-run'");
        const InstallAngleArguments arguments{
            std::move(recordings), std::move(robot),           side_m, std::move(ends), sigma_m,
            sigma_heading_deg,     start_heading == "each-run"};
        return by_library([&] { return answer_install_angle(arguments); });
      },
      py::kw_only(), py::arg("recordings"), py::arg("robot"), py::arg("side_m"), py::arg("ends"),
      py::arg("sigma_m"), py::arg("sigma_heading_deg"), py::arg("start_heading"));
}

}  // namespace

void bind_squares(py::module_& module) {
  module.def("umbmark", &umbmark, py::arg("inputs"), py::arg("robot"), py::kw_only(), py::arg("side_m"),
             py::arg("method"));
  bind_install_angle(module);
}

}  // namespace trundle::python
