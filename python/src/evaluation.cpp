#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <pybind11/stl.h>

#include "trundle/io/error.hpp"
#include "trundle/pipeline/evaluation_answer.hpp"

#include "binding.hpp"
#include "call.hpp"

namespace trundle::python {
namespace {

const std::string& place_of(const RecordingFile& file) {
  return file.path.empty() ? file.recording.name : file.path;
}

std::filesystem::path path_of_trajectory(const char* argument, const py::object& given) {
  return path_of(argument, given, "a trajectory, a recording with a reference, or the path of either");
}

/// Of a trajectory, a recording, which has a reference, or the path of either.
TrajectoryFile estimate_given(const py::object& given) {
  if (py::isinstance<Trajectory>(given)) {
    const auto& trajectory = given.cast<const Trajectory&>();
    return without_gil([&] { return TrajectoryFile{trajectory, {}}; });
  }
  if (py::isinstance<RecordingFile>(given)) {
    const auto& file = given.cast<const RecordingFile&>();
    return by_library([&] { return reference_of(file.recording, place_of(file)); });
  }
  const auto path = path_of_trajectory("estimate", given);
  return by_library([&] { return read_trajectory_file(path); });
}

/// The same, on the estimate's clock.
TrajectoryFile reference_given(const py::object& given, const TrajectoryFile& estimate,
                               const ClockQuestion& question) {
  if (py::isinstance<Trajectory>(given)) {
    const auto& trajectory = given.cast<const Trajectory&>();
    TrajectoryFile reference = without_gil([&] { return TrajectoryFile{trajectory, {}}; });
    return by_library([&] { return on_clock_of(estimate, std::move(reference), question); });
  }
  if (py::isinstance<RecordingFile>(given)) {
    const auto& file = given.cast<const RecordingFile&>();
    return by_library([&] { return on_clock_of(estimate, file.recording, place_of(file), question); });
  }
  const auto path = path_of_trajectory("reference", given);
  return by_library([&] { return on_clock_of(estimate, path, question); });
}

Alignment alignment_named(const std::string& name) {
  for (const Alignment alignment : {Alignment::none, Alignment::start, Alignment::se2})
    if (name == name_of(alignment)) return alignment;
  throw InputError("align", fmt::format("is '{}'", name), "'none', 'start' or 'se2'");
}

EvaluationAnswer evaluate(const py::object& estimate, const py::object& reference, const std::string& align,
                          double longest_gap_s, const RobotFile* robot, std::optional<double> time_offset_s) {
  require_from("longest_gap_s", longest_gap_s, kSmallest, kLargest);
  if (time_offset_s) require_from("time_offset_s", *time_offset_s, -kLargest, kLargest);
  const EvaluateOptions options{.alignment = alignment_named(align), .longest_gap_s = longest_gap_s};
  const TrajectoryFile mine = estimate_given(estimate);
  const TrajectoryFile truth = reference_given(
      reference, mine, {.robot = robot, .longest_gap_s = longest_gap_s, .time_offset_s = time_offset_s});
  return by_library([&] { return answer_evaluation(mine, truth, options, robot); });
}

void bind_evaluation_parts(py::module_& module) {
  py::class_<ErrorStatistics>(module, "ErrorStatistics", "Of errors that are at least 0.")
      .def_readonly("rms", &ErrorStatistics::rms)
      .def_readonly("mean", &ErrorStatistics::mean)
      .def_readonly("median", &ErrorStatistics::median)
      .def_readonly("max", &ErrorStatistics::max);
  py::class_<RelativePoseError>(module, "RelativePoseError",
                                "Of the motion between two poses a distance apart along the path.")
      .def_readonly("distance_m", &RelativePoseError::distance_m)
      .def_readonly("pairs", &RelativePoseError::pairs, "0: the path is too short.")
      .def_readonly("translation_rms_m", &RelativePoseError::translation_rms_m)
      .def_readonly("translation_mean_percent", &RelativePoseError::translation_mean_percent)
      .def_readonly("heading_rms_rad", &RelativePoseError::heading_rms_rad);
  py::class_<Nees>(module, "Nees",
                   "Normalised estimation error squared: whether covariances say how large errors are.")
      .def_readonly("degrees_of_freedom", &Nees::degrees_of_freedom, "Its mean if they do.")
      .def_readonly("mean", &Nees::mean)
      .def_readonly("share_inside_95", &Nees::share_inside_95)
      .def_readonly("poses", &Nees::poses);
}

}  // namespace

void bind_evaluation(py::module_& module) {
  bind_evaluation_parts(module);
  py::class_<EvaluationAnswer> bound(module, "Evaluation", "How far a trajectory is from a reference.");
  const auto field = [&](const char* name, auto member, const char* text) {
    bound.def_property_readonly(
        name, [member](const EvaluationAnswer& self) { return self.evaluation.*member; }, text);
  };
  field("position_m", &Evaluation::position_m, "Absolute trajectory error.");
  field("heading_rms_rad", &Evaluation::heading_rms_rad, "None: the reference has no heading.");
  field("final_position_m", &Evaluation::final_position_m, "");
  field("final_percent", &Evaluation::final_percent, "The same, of the path.");
  field("path_m", &Evaluation::path_m, "");
  field("compared", &Evaluation::compared, "How many poses.");
  field("first_s", &Evaluation::first_s, "");
  field("last_s", &Evaluation::last_s, "");
  field("relative", &Evaluation::relative, "For each distance.");
  field("nees", &Evaluation::nees, "None: the estimate has no covariances.");
  field("reference_from_estimate", &Evaluation::reference_from_estimate, "The motion that aligns them.");
  bound
      .def_property_readonly(
          "time_offset_s",
          [](const EvaluationAnswer& self) -> std::optional<double> {
            return self.clock ? std::optional(self.clock->offset_s) : std::nullopt;
          },
          "Of the reference, whose stamps were moved; None: they stay as they are.")
      .def_property_readonly(
          "alignment",
          [](const EvaluationAnswer& self) { return std::string(name_of(self.evaluation.alignment)); })
      .def("__repr__", [](const EvaluationAnswer& self) {
        return fmt::format("<Evaluation: {:.4f} m rms over {:.2f} m, {} poses, alignment '{}'>",
                           self.evaluation.position_m.rms, self.evaluation.path_m, self.evaluation.compared,
                           name_of(self.evaluation.alignment));
      });
  const auto document = [](const EvaluationAnswer& answer) { return document_of(answer); };
  add_document(bound, document);
  add_save_of_document(bound, document, "Writes what `trundle evaluate --json` prints.");
  add_python_methods(bound, "A DataFrame with the relative errors, a row for each distance.");

  module.def("evaluate", &evaluate, py::arg("estimate"), py::arg("reference"), py::kw_only(),
             py::arg("align"), py::arg("longest_gap_s"), py::arg("robot"), py::arg("time_offset_s"));
}

}  // namespace trundle::python
