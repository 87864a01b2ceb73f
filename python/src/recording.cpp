#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <pybind11/stl.h>

#include "trundle/io/error.hpp"
#include "trundle/pipeline/info_answer.hpp"
#include "trundle/pipeline/provenance.hpp"
#include "trundle/recording/columns.hpp"

#include "binding.hpp"
#include "call.hpp"
#include "views.hpp"

namespace trundle::python {
namespace {

/// A column of a stream as it was handed over, and its place in errors.
struct Column {
  std::string stream;
  std::string name;
  py::handle values;
};

std::string text_of(const py::handle& value) {
  return py::str(value).cast<std::string>();
}

/// Its values in a row; of their own type, or of objects.
py::array array_of(const Column& column, bool as_objects = false) {
  const py::array array = py::array::ensure(
      as_objects ? py::object(py::module_::import("numpy").attr("asarray")(column.values, "O"))
                 : py::reinterpret_borrow<py::object>(column.values));
  if (!array || array.ndim() != 1)
    throw InputError(column.stream,
                     fmt::format("column '{}' is {}", column.name,
                                 array ? fmt::format("an array of {} axes", array.ndim()) : "no array"),
                     "an array of one axis, with a value for each row");
  return array;
}

/// Of a numpy.ma.MaskedArray.
template <class Value>
void clear_masked(const Column& column, std::vector<Value>& values, const Value& nothing) {
  const py::module_ masked = py::module_::import("numpy.ma");
  if (!py::isinstance(column.values, masked.attr("MaskedArray"))) return;
  const py::array_t<bool> mask = masked.attr("getmaskarray")(column.values);
  for (py::ssize_t row = 0; row < mask.size(); ++row)
    if (mask.at(row)) values[static_cast<std::size_t>(row)] = nothing;
}

/// None, and what does not equal itself: NaN, NaT, and pandas.NA, which does not say.
bool is_missing(const py::handle& value) {
  if (value.is_none()) return true;
  const auto differs =
      py::reinterpret_steal<py::object>(PyObject_RichCompare(value.ptr(), value.ptr(), Py_NE));
  const int answer = differs ? PyObject_IsTrue(differs.ptr()) : -1;
  const bool does_not_say = answer < 0 && PyErr_ExceptionMatches(PyExc_TypeError);
  PyErr_Clear();
  return answer > 0 || does_not_say;
}

[[noreturn]] void refuse_value(const Column& column, py::ssize_t row, const std::string& value,
                               const std::string& expected) {
  constexpr std::size_t kShown = 40;
  const std::string shown = value.size() <= kShown ? value : value.substr(0, kShown) + "…";
  throw InputError(place(column.stream, static_cast<std::size_t>(row) + 1),
                   fmt::format("{} is {}", column.name, shown), expected);
}

/// One by one, as Python's float() has them: of objects, texts.
std::vector<double> numbers_of_objects(const Column& column, const py::array& array) {
  std::vector<double> numbers;
  for (const py::handle& value : array) {
    double number = kNotMeasured;
    if (!is_missing(value)) {
      const auto converted = py::reinterpret_steal<py::object>(PyNumber_Float(value.ptr()));
      PyErr_Clear();
      if (!converted)
        refuse_value(column, std::ssize(numbers), py::repr(value).cast<std::string>(), "a number");
      number = PyFloat_AS_DOUBLE(converted.ptr());
    }
    numbers.push_back(number);
  }
  return numbers;
}

/// Beyond it a double does not tell each whole number from the next.
constexpr double kLargestWhole = 9007199254740992.0;

/// NaN where a value is missing, or masked.
std::vector<double> numbers_of(const Column& column) {
  const py::array array = array_of(column);
  const char kind = array.dtype().kind();
  if (kind == 'M' || kind == 'm')
    throw InputError(column.stream,
                     fmt::format("column '{}' is of type {}", column.name, text_of(array.dtype())),
                     "numbers: stamps in seconds");
  std::vector<double> numbers;
  if (std::string_view("fiub").find(kind) == std::string_view::npos) {
    numbers = numbers_of_objects(column, array);
  } else {
    const py::array_t<double, py::array::c_style | py::array::forcecast> converted(array);
    numbers.assign(converted.data(), converted.data() + converted.size());
  }
  clear_masked(column, numbers, kNotMeasured);
  if (kind != 'f')
    for (const double& number : numbers)
      if (std::isfinite(number) && std::abs(number) > kLargestWhole)
        refuse_value(column, &number - numbers.data(), text_of(array[py::int_(&number - numbers.data())]),
                     fmt::format("at most ±{:.0f}: subtract the first", kLargestWhole));
  return numbers;
}

std::vector<std::string> texts_of(const Column& column) {
  std::vector<std::string> texts;
  for (const py::handle& value : array_of(column, true))
    texts.push_back(is_missing(value) ? "" : text_of(value));
  clear_masked(column, texts, std::string());
  return texts;
}

/// The names of its columns, where it is a mapping of them: a dictionary, a DataFrame, a structured array.
py::object names_of(const std::string& stream, const py::object& columns) {
  if (py::hasattr(columns, "keys")) return columns.attr("keys")();
  const py::object names = py::getattr(py::getattr(columns, "dtype", py::none()), "names", py::none());
  if (!names.is_none()) return names;
  throw py::type_error(
      fmt::format("{}: is of type {}; expected columns by name: a dictionary of arrays, a "
                  "DataFrame or a structured array",
                  stream, text_of(py::type::handle_of(columns).attr("__name__"))));
}

StreamColumns stream_of(const std::string& name, const py::object& columns) {
  StreamColumns stream{.stream = name, .numbers = {}};
  for (const py::handle& key : names_of(name, columns)) {
    const std::string column = text_of(key);
    const py::object values = columns[key];
    if (column == "landmark")
      stream.landmarks = texts_of({name, column, values});
    else if (has_column(name, column))
      stream.numbers.emplace_back(column, numbers_of({name, column, values}));
    else
      stream.left_out.push_back(column);
  }
  return stream;
}

RecordingFile from_arrays(const std::string& name, const py::kwargs& streams) {
  std::vector<StreamColumns> columns;
  for (const auto& [stream, values] : streams)
    if (!values.is_none())
      columns.push_back(stream_of(text_of(stream), py::reinterpret_borrow<py::object>(values)));
  return {without_gil([&] { return recording_of(name, std::move(columns)); }), {}};
}

RecordingFile read_file_of(const std::filesystem::path& path, int robot_number,
                           const std::filesystem::path& map,
                           const std::vector<std::filesystem::path>& msg_path) {
  if (robot_number != 0) require_from("robot_number", robot_number, 1, 1000);
  ReadOptions reading{.robot_number = robot_number, .map = map.string(), .msg_path = {}};
  for (const std::filesystem::path& folder : msg_path) reading.msg_path.push_back(folder.string());
  const std::string again = reading == ReadOptions{} ? path.string() : "";
  return {without_gil([&] { return read_recording(path, reading); }), reading, again};
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

py::object info_of(const RecordingFile& self, const RobotFile* robot, bool gyro_noise) {
  InfoQuestion question{.robot = {}, .gyro_noise = gyro_noise, .reading = self.reading};
  if (robot != nullptr) question.robot = *robot;
  return python_of(without_gil([&] {
    const std::vector<Recording> recordings = {self.recording};
    check_interruption();
    return document_of(answer_info(recordings, question));
  }));
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
    for (Recording& recording : without_gil([&] { return read_recordings({folder.string()}); }))
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
          "to_dict", [](const RecordingFile& self) { return info_of(self, nullptr, false); },
          "What `trundle info --json` prints of it, as dictionaries and lists.")
      .def("info", &info_of, py::arg("robot") = nullptr, py::kw_only(), py::arg("gyro_noise") = false,
           "What `trundle info --json` prints of it.")
      .def(
          "save",
          [](const RecordingFile& self, const std::filesystem::path& folder) {
            without_gil([&] { write_recording(self.recording, folder); });
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
