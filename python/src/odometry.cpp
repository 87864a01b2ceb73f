#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <pybind11/stl.h>

#include "trundle/pipeline/odometry_answer.hpp"
#include "trundle/pipeline/outputs.hpp"
#include "trundle/pipeline/sentences.hpp"

#include "binding.hpp"
#include "call.hpp"
#include "views.hpp"

namespace trundle::python {
namespace {

OdometryAnswer odometry(const RecordingFile& recording, const RobotFile& robot,
                        const std::optional<StartTuple>& start, bool smooth) {
  const Start from = start_of(start);
  const OdometryQuestion question{
      .start = from.pose, .start_text = from.text, .smooth = smooth, .reading = recording.reading};
  return by_library([&] { return answer_odometry(recording.recording, robot, question); });
}

template <class Number>
auto bias_column(Number number) {
  return [number](const py::object& self) {
    return column(self, self.cast<const OdometryAnswer&>().odometry.gyro_bias, number);
  };
}

}  // namespace

void bind_odometry(py::module_& module) {
  py::class_<OdometryAnswer> bound(module, "Odometry", "A trajectory with its covariance, and its evidence.");
  const auto field = [&](const char* name, auto member, const char* text) {
    bound.def_property_readonly(
        name, [member](const OdometryAnswer& self) { return self.odometry.*member; }, text);
  };
  field("path_length_m", &IntegratedOdometry::path_length_m, "");
  field("degrees_of_freedom", &IntegratedOdometry::degrees_of_freedom,
        "Readings beyond those that the motion needs: what could show slip.");
  field("bridged_gaps", &IntegratedOdometry::bridged, "Intervals that span a gap.");
  field("rest_s", &IntegratedOdometry::rest_s, "How long the robot stood still.");
  field("uncertain_parameters", &IntegratedOdometry::parameters,
        "Calibrated parameters whose uncertainty the covariance has.");
  field("findings", &IntegratedOdometry::findings, "What was noticed.");
  bound
      .def_property_readonly(
          "trajectory",
          [](const OdometryAnswer& self) -> const Trajectory& { return self.odometry.trajectory; },
          py::return_value_policy::reference_internal)
      .def_property_readonly(
          "end", [](const OdometryAnswer& self) { return self.odometry.end.pose; }, "The last pose.")
      .def_property_readonly(
          "end_covariance",
          [](const py::object& self) {
            return view(self, self.cast<const OdometryAnswer&>().odometry.end_covariance);
          },
          "Of its (x, y, heading) in world axes.")
      .def_property_readonly("gyro_bias_time_s",
                             bias_column([](const GyroBiasAt& row) -> const double& { return row.time_s; }))
      .def_property_readonly("gyro_bias_rad_s",
                             bias_column([](const GyroBiasAt& row) -> const double& { return row.rad_s; }),
                             "Learned where the robot stood still.")
      .def_property_readonly("gyro_bias_sigma_rad_s", bias_column([](const GyroBiasAt& row) -> const double& {
                               return row.sigma_rad_s;
                             }))
      .def(
          "save",
          [](const OdometryAnswer& self, const std::filesystem::path& path) {
            const auto files = [&] {
              return std::vector{trajectory_file(path, self.provenance, self.odometry.trajectory)};
            };
            save(files, self.provenance);
          },
          py::arg("path"), "Writes the trajectory: .csv, or .tum by its name.")
      .def("__repr__", [](const OdometryAnswer& self) {
        return fmt::format("<Odometry: {}>", sentence_of(self.odometry));
      });
  add_document(bound, [](const OdometryAnswer& answer) { return document_of(answer); });
  add_python_methods(bound, "A DataFrame with the columns of trajectory.csv.");

  module.def("odometry", &odometry, py::arg("recording"), py::arg("robot"), py::kw_only(), py::arg("start"),
             py::arg("smooth"));
}

}  // namespace trundle::python
