#include <fmt/format.h>
#include <pybind11/stl.h>

#include "trundle/chassis/parameter.hpp"
#include "trundle/io/error.hpp"
#include "trundle/pipeline/files.hpp"

#include "binding.hpp"

namespace trundle::python {
namespace {

py::dict parameters_by_name(const RobotFile& self) {
  py::dict parameters;
  for (const Parameter& parameter : parameters_of(self.robot))
    parameters[py::str(name_of(parameter, self.robot))] = value_of(parameter, self.robot);
  return parameters;
}

/// Another robot with these parameters, as a file would say it.
RobotFile with_parameters(const RobotFile& self, const std::map<std::string, double>& values) {
  Robot robot = self.robot;
  for (const auto& [name, value] : values) {
    const auto parameter = parameter_named(name, robot);
    if (!parameter) {
      std::vector<std::string> names;
      for (const Parameter& known : parameters_of(robot)) names.push_back(name_of(known, robot));
      const std::string nearest = nearest_name(name, names);
      throw InputError(place_of(robot), fmt::format("has no parameter '{}'", name),
                       nearest.empty() ? "one of Robot.parameters" : fmt::format("'{}'", nearest));
    }
    set_value(*parameter, value, robot);
  }
  const std::string toml = to_toml(robot);
  return {parse_robot(toml, self.file.path), {self.file.path, sha256_of(toml)}};
}

}  // namespace

void bind_robot(py::module_& module) {
  py::class_<RobotFile>(module, "Robot", "A robot file: wheels, gyro and sensors, and their calibration.")
      .def(py::init([](const std::filesystem::path& path) {
             return by_library([&] { return read_robot_file(path); });
           }),
           py::arg("path"))
      .def_static(
          "parse",
          [](const std::string& toml, const std::string& name) {
            return RobotFile{parse_robot(toml, name), {name, sha256_of(toml)}};
          },
          py::arg("toml"), py::arg("name") = "robot.toml",
          "The robot that such a text describes; `name` is its place in errors.")
      .def_property_readonly("name", [](const RobotFile& self) { return self.robot.name; })
      .def_property_readonly(
          "path", [](const RobotFile& self) { return self.file.path; }, "The file that said so.")
      .def_property_readonly(
          "wheels", [](const RobotFile& self) { return self.robot.wheel_names; },
          "The names of the wheels with an encoder.")
      .def_property_readonly("parameters", &parameters_by_name,
                             "All that a calibration may change, by name: docs/parameters.md.")
      .def("with_parameters", &with_parameters, py::arg("values"),
           "Another robot with these values of some parameters.")
      .def(
          "to_toml", [](const RobotFile& self) { return to_toml(self.robot); }, "The text of its file.")
      .def(
          "save",
          [](const RobotFile& self, const std::filesystem::path& path) {
            without_gil([&] { write_file(path, to_toml(self.robot)); });
          },
          py::arg("path"), "Writes the robot file.")
      .def(py::pickle(
          [](const RobotFile& self) {
            return py::make_tuple(to_toml(self.robot), self.file.path, self.file.sha256);
          },
          [](const py::tuple& state) {
            const auto path = state[1].cast<std::string>();
            return RobotFile{parse_robot(state[0].cast<std::string>(), path),
                             {path, state[2].cast<std::string>()}};
          }))
      .def("__repr__", [](const RobotFile& self) {
        return fmt::format("<Robot '{}', {} wheels{}>", self.robot.name, self.robot.wheel_names.size(),
                           self.robot.calibration ? ", calibrated" : "");
      });
}

}  // namespace trundle::python
