#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <pybind11/stl.h>

#include "trundle/calibration/export.hpp"
#include "trundle/io/error.hpp"
#include "trundle/pipeline/calibration_answer.hpp"

#include "binding.hpp"
#include "call.hpp"
#include "views.hpp"

namespace trundle::python {
namespace {

CalibrationAnswer calibrate(const py::iterable& runs, const RobotFile& robot, const py::iterable& hold_out,
                            const CalibrateOptions& options, bool landmarks) {
  const std::vector<Recording> training = recordings_of("runs", runs);
  if (training.empty()) throw InputError("runs", "name none", "recordings, or folders that hold some");
  if (options.with_reference && !landmarks)
    throw InputError("with_reference", "is given alone", "landmarks=True");
  const std::vector<Recording> held_out = recordings_of("hold_out", hold_out);
  const auto answer = landmarks ? answer_landmark_calibration : answer_calibration;
  return by_library([&] { return answer(training, held_out, robot, options); });
}

/// As who reads the file that is saved gets it.
RobotFile robot_of(const CalibrationAnswer& answer) {
  const std::string toml = to_toml(answer.result.calibrated);
  return {parse_robot(toml, "calibrated.toml"), {"calibrated.toml", sha256_of(toml)}};
}

void save_calibration(const CalibrationAnswer& answer, const std::filesystem::path& path,
                      const std::string& format) {
  const auto formats = export_formats();
  if (!format.empty() && std::ranges::find(formats, format) == formats.end())
    throw InputError("export", fmt::format("is '{}'", format),
                     nearest_name(format, std::vector<std::string>(formats.begin(), formats.end())));
  save([&] { return files_of(answer, path, format); }, answer.provenance);
}

const ParameterEstimate& parameter_of(const CalibrationAnswer& answer, const std::string& name) {
  for (const ParameterEstimate& estimate : answer.result.parameters)
    if (estimate.name == name) return estimate;
  throw py::key_error(name);
}

void bind_calibration_parts(py::module_& module) {
  py::class_<ParameterEstimate>(module, "ParameterEstimate", "One parameter after calibration.")
      .def_readonly("name", &ParameterEstimate::name)
      .def_readonly("unit", &ParameterEstimate::unit)
      .def_readonly("nominal", &ParameterEstimate::nominal)
      .def_readonly("value", &ParameterEstimate::value, "Equal to nominal where it is not observable.")
      .def_readonly("sigma", &ParameterEstimate::sigma_total, "1 sigma of a further session.")
      .def_readonly("sigma_within", &ParameterEstimate::sigma_within, "From the noise of the runs alone.")
      .def_readonly("sigma_between", &ParameterEstimate::sigma_between,
                    "From session to session; None: fewer than two.")
      .def_readonly("observable", &ParameterEstimate::observable)
      .def("__repr__", [](const ParameterEstimate& self) {
        return fmt::format("<{} = {:.8g} ± {:.2g} {}>", self.name, self.value, self.sigma_total, self.unit);
      });
  py::class_<ErrorBeforeAfter>(module, "ErrorBeforeAfter",
                               "An error with the robot as given, and calibrated.")
      .def_readonly("what", &ErrorBeforeAfter::what)
      .def_readonly("before", &ErrorBeforeAfter::before)
      .def_readonly("after", &ErrorBeforeAfter::after)
      .def_readonly("unit", &ErrorBeforeAfter::unit)
      .def("__repr__", [](const ErrorBeforeAfter& self) {
        return fmt::format("<{}: {:.5g} -> {:.5g} {}>", self.what, self.before, self.after, self.unit);
      });
}

}  // namespace

void bind_calibration(py::module_& module) {
  bind_calibration_parts(module);
  py::class_<CalibrationAnswer> calibration(module, "Calibration", "A calibrated robot, and the evidence.");
  const auto field = [&](const char* name, auto member, const char* text) {
    calibration.def_property_readonly(
        name, [member](const CalibrationAnswer& self) { return self.result.*member; }, text);
  };
  field("method", &CalibrationResult::method, "'classic', 'orientation' or 'ml'.");
  field("summary", &CalibrationResult::summary, "One sentence that can be acted on.");
  field("unobservable", &CalibrationResult::unobservable, "What the runs do not show, in words.");
  field("warnings", &CalibrationResult::warnings, "");
  field("notes", &CalibrationResult::notes, "");
  field("sessions", &CalibrationResult::sessions, "How many sessions the runs are of.");
  calibration.def_property_readonly("robot", &robot_of, "The calibrated robot.")
      .def_property_readonly(
          "parameters",
          [](const py::object& self) {
            py::list all;
            for (const ParameterEstimate& one : self.cast<const CalibrationAnswer&>().result.parameters)
              all.append(py::cast(one, py::return_value_policy::reference_internal, self));
            return all;
          })
      .def("__getitem__", &parameter_of, py::arg("name"), py::return_value_policy::reference_internal,
           "The parameter of that name.")
      .def_property_readonly(
          "covariance",
          [](const py::object& self) {
            return view(self, self.cast<const CalibrationAnswer&>().result.covariance_total);
          },
          "Of the observable parameters, in their order; between sessions included where it is known.")
      .def_property_readonly(
          "errors",
          [](const CalibrationAnswer& self) {
            const auto& record = self.result.calibrated.calibration;
            return record ? record->errors : std::vector<ErrorBeforeAfter>{};
          },
          "Start-aligned, on the runs and on those that were held out.")
      .def("save", &save_calibration, py::arg("path"), py::kw_only(), py::arg("export") = "",
           "Writes the robot file, calibration.json beside it and, where one is named, the export.")
      .def("__repr__", [](const CalibrationAnswer& self) {
        return fmt::format("<Calibration: {}>", self.result.summary);
      });
  add_document(calibration, [](const CalibrationAnswer& answer) { return document_of(answer); });
  add_python_methods(calibration, "A DataFrame with a row for each parameter.");

  module.def(
      "calibrate",
      [](const py::iterable& runs, const RobotFile& robot, const py::iterable& hold_out,
         std::vector<std::string> free, std::vector<std::string> fix, bool learn_noise, bool landmarks,
         bool with_reference) {
        return calibrate(runs, robot, hold_out,
                         {std::move(free), std::move(fix), learn_noise, with_reference}, landmarks);
      },
      py::arg("runs"), py::arg("robot"), py::kw_only(), py::arg("hold_out"), py::arg("free"), py::arg("fix"),
      py::arg("learn_noise"), py::arg("landmarks"), py::arg("with_reference"));
}

}  // namespace trundle::python
