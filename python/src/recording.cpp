#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <pybind11/stl.h>

#include "trundle/io/error.hpp"
#include "trundle/pipeline/info_answer.hpp"
#include "trundle/pipeline/provenance.hpp"
#include "trundle/recording/columns.hpp"

#include "arrays.hpp"
#include "binding.hpp"
#include "call.hpp"
#include "views.hpp"

namespace trundle::python {
namespace {

RecordingFile from_arrays(const std::string& name, const py::kwargs& streams) {
  std::vector<StreamColumns> columns;
  for (const auto& [stream, values] : streams)
    if (!values.is_none())
      columns.push_back(stream_of(py::cast<std::string>(stream), py::reinterpret_borrow<py::object>(values)));
  return {by_library([&] { return recording_of(name, std::move(columns)); }), {}};
}

RecordingFile read_file_of(const std::filesystem::path& path, int robot_number,
                           const std::filesystem::path& map,
                           const std::vector<std::filesystem::path>& msg_path) {
  if (robot_number != 0) require_from("robot_number", robot_number, 1, 1000);
  ReadOptions reading{.robot_number = robot_number, .map = map.string(), .msg_path = {}};
  for (const std::filesystem::path& folder : msg_path) reading.msg_path.push_back(folder.string());
  const std::string again = reading == ReadOptions{} ? path.string() : "";
  return {by_library([&] { return read_recording(path, reading); }), reading, again};
}

std::vector<RecordingFile> read_below(const std::filesystem::path& folder) {
  std::vector<RecordingFile> recordings;
  without_gil([&] {
    for (const std::filesystem::path& path : recordings_below(folder))
      recordings.push_back({read_recording(path), {}, path.string()});
  });
  return recordings;
}

py::dict wheels_of(const py::object& self) {
  const WheelStream& wheels = self.cast<const RecordingFile&>().recording.wheels;
  py::dict columns;
  if (wheels.time_s.empty()) return columns;
  columns["time_s"] = view(self, wheels.time_s);
  for (const auto& [name, values] : columns_of(wheels)) columns[py::str(name)] = view(self, *values);
  return columns;
}

using NamedVector = std::pair<const char*, const std::vector<double>*>;
py::dict dictionary_of(const py::object& self, std::initializer_list<NamedVector> vectors) {
  py::dict columns;
  for (const auto& [name, values] : vectors)
    if (!vectors.begin()->second->empty()) columns[name] = view(self, *values);
  return columns;
}

py::dict velocity_of(const py::object& self, const VelocityStream& stream) {
  return dictionary_of(self, {{"time_s", &stream.time_s},
                              {"forward_m_s", &stream.forward_m_s},
                              {"yaw_rate_rad_s", &stream.yaw_rate_rad_s}});
}

py::dict sightings_of(const py::object& self) {
  const std::vector<Sighting>& sightings = self.cast<const RecordingFile&>().recording.sightings;
  py::dict columns;
  if (sightings.empty()) return columns;
  py::list names;
  for (const Sighting& sighting : sightings) names.append(sighting.landmark);
  columns["time_s"] = column(self, sightings, [](const Sighting& s) -> const double& { return s.time_s; });
  columns["landmark"] = names;
  columns["range_m"] = column(self, sightings, [](const Sighting& s) -> const double& { return s.range_m; });
  columns["bearing_rad"] =
      column(self, sightings, [](const Sighting& s) -> const double& { return s.bearing_rad; });
  return columns;
}

py::dict landmarks_of(const RecordingFile& self) {
  py::dict places;
  for (const Landmark& landmark : self.recording.landmarks)
    places[py::str(landmark.name)] = py::make_tuple(landmark.position.x(), landmark.position.y());
  return places;
}

py::object info_of(const RecordingFile& self, const py::object& robot, bool gyro_noise) {
  InfoQuestion question{.robot = {}, .gyro_noise = gyro_noise, .reading = self.reading};
  if (!robot.is_none()) question.robot = robot_given(robot);
  std::vector<Recording> recordings;
  recordings.push_back(copy_of(self));
  return python_of(by_library([&] { return document_of(answer_info(recordings, question)); }));
}

void bind_finding(py::module_& module) {
  py::class_<Finding>(module, "Finding",
                      "Something that is wrong with a recording or a result, or worth knowing.")
      .def_property_readonly(
          "severity", [](const Finding& self) { return word_of(self.severity); }, "'warning' or 'note'.")
      .def_property_readonly(
          "kind", [](const Finding& self) { return std::string(name_of(self.code)); },
          "As docs/log-faults.md lists them.")
      .def_readonly("place", &Finding::place, "'file:line' of the first.")
      .def_readonly("count", &Finding::count, "Of rows, intervals or sightings.")
      .def_property_readonly(
          "message", [](const Finding& self) { return describe(self); }, "One sentence that can be acted on.")
      .def("__repr__", [](const Finding& self) {
        return fmt::format("<{}: {}: {}>", word_of(self.severity), self.place, describe(self));
      });
}

}  // namespace

std::vector<Recording> recordings_of(const char* argument, const py::iterable& runs) {
  std::vector<Recording> recordings;
  for (const py::handle& run : runs) {
    if (py::isinstance<RecordingFile>(run)) {
      recordings.push_back(copy_of(run.cast<const RecordingFile&>()));
      continue;
    }
    const auto folder = path_of(argument, run, "recordings, or the paths of folders that hold some");
    for (Recording& recording : by_library([&] { return read_recordings({folder.string()}); }))
      recordings.push_back(std::move(recording));
  }
  return recordings;
}

void bind_recording(py::module_& module) {
  bind_finding(module);
  module.def(
      "recordings_below",
      [](const std::filesystem::path& folder) {
        std::vector<std::string> paths;
        for (const std::filesystem::path& path : recordings_below(folder)) paths.push_back(path.string());
        return paths;
      },
      py::arg("folder"));
  py::class_<RecordingFile> recording(
      module, "Recording",
      "What a robot's sensors recorded: a folder of CSV files, a log that a recording.toml maps, or arrays.\n"
      "Each stream is a dictionary of its columns, empty where it was not recorded; the arrays show the\n"
      "recording's own memory.");
  recording
      .def(py::init(&read_file_of), py::arg("path"), py::kw_only(), py::arg("robot_number") = 0,
           py::arg("map") = "", py::arg("msg_path") = std::vector<std::filesystem::path>{})
      .def_static(
          "from_arrays", &from_arrays, py::arg("name") = "recording",
          // What inspect.signature shows.
          "from_arrays(name='recording', *, wheels=None, gyro=None, velocity=None, commands=None, "
          "accel=None,\n"
          "sightings=None, reference=None, relative=None, landmarks=None)\n--\n\n"
          "The recording of streams that are in memory, each a mapping of its columns: a dictionary of "
          "arrays, a\n"
          "DataFrame, a structured array. Streams and columns are those of a folder's files "
          "(docs/recording.md):\n"
          "wheels (time_s, <wheel>_ticks, _m or _rad_s), gyro (time_s, yaw_rate_rad_s), sightings (time_s,\n"
          "landmark, range_m, bearing_rad), reference (time_s, x_m, y_m, heading_rad), landmarks (landmark, "
          "x_m,\n"
          "y_m), velocity, commands, accel, relative. NaN, None or masked: not measured. Other columns are "
          "left\n"
          "out.")
      .def_static("below", &read_below, py::arg("folder"), "All recordings in and below a folder, in order.")
      .def_property_readonly("name", [](const RecordingFile& self) { return self.recording.name; })
      .def_readonly(
          "path", &RecordingFile::path,
          "The folder or log that gives it again; empty of arrays, and of what was read with options.")
      .def_property_readonly("session", [](const RecordingFile& self) { return self.recording.session; })
      .def_property_readonly("wheels", &wheels_of)
      .def_property_readonly(
          "gyro",
          [](const py::object& self) {
            const GyroStream& gyro = self.cast<const RecordingFile&>().recording.gyro;
            return dictionary_of(self, {{"time_s", &gyro.time_s}, {"yaw_rate_rad_s", &gyro.yaw_rate_rad_s}});
          })
      .def_property_readonly("velocity",
                             [](const py::object& self) {
                               return velocity_of(self, self.cast<const RecordingFile&>().recording.velocity);
                             })
      .def_property_readonly("commands",
                             [](const py::object& self) {
                               return velocity_of(self, self.cast<const RecordingFile&>().recording.commands);
                             })
      .def_property_readonly(
          "accel",
          [](const py::object& self) {
            const AccelStream& accel = self.cast<const RecordingFile&>().recording.accel;
            return dictionary_of(
                self, {{"time_s", &accel.time_s}, {"x_m_s2", &accel.x_m_s2}, {"y_m_s2", &accel.y_m_s2}});
          })
      .def_property_readonly("sightings", &sightings_of)
      .def_property_readonly("reference",
                             [](const py::object& self) {
                               const ReferenceStream& reference =
                                   self.cast<const RecordingFile&>().recording.reference;
                               return dictionary_of(self, {{"time_s", &reference.time_s},
                                                           {"x_m", &reference.x_m},
                                                           {"y_m", &reference.y_m},
                                                           {"heading_rad", &reference.heading_rad}});
                             })
      .def_property_readonly("landmarks", &landmarks_of, "Known places, by name: (x_m, y_m).")
      .def_property_readonly(
          "findings", [](const RecordingFile& self) { return self.recording.findings; },
          "What was noticed when it was read.")
      .def(
          "to_dict", [](const RecordingFile& self) { return info_of(self, py::none(), false); },
          "What `trundle info --json` prints of it, as dictionaries and lists.")
      .def("info", &info_of, py::arg("robot") = py::none(), py::kw_only(), py::arg("gyro_noise") = false,
           "What `trundle info --json` prints of it.")
      .def(
          "save",
          [](const RecordingFile& self, const std::filesystem::path& folder) {
            without_gil([&] {
              require_apart(std::span(&self.recording, 1), {folder});
              write_recording(self.recording, folder);
            });
          },
          py::arg("folder"), "Writes it as a folder of CSV files.")
      .def("__repr__", [](const RecordingFile& self) {
        return fmt::format("<Recording '{}', {} rows of wheels, {} of the gyro, {} sightings>",
                           self.recording.name, self.recording.wheels.time_s.size(),
                           self.recording.gyro.time_s.size(), self.recording.sightings.size());
      });
  add_python_methods(recording, "A DataFrame of one stream: `to_pandas('wheels')`.");
}

}  // namespace trundle::python
