/// The parts of the module, each bound in a file of its own, and what they share.
#pragma once

#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include <nlohmann/json_fwd.hpp>
#include <pybind11/pybind11.h>
#include <pybind11/stl/filesystem.h>

#include "trundle/geometry/pose2.hpp"
#include "trundle/pipeline/files.hpp"
#include "trundle/pipeline/slip_answer.hpp"
#include "trundle/recording/recording.hpp"
#include "trundle/report/json_text.hpp"

#include "call.hpp"

namespace trundle::python {

namespace py = pybind11;
using namespace pipeline;

void bind_trajectory(py::module_& module);
void bind_robot(py::module_& module);
void bind_recording(py::module_& module);
void bind_calibration(py::module_& module);
void bind_odometry(py::module_& module);
void bind_slip(py::module_& module);
void bind_slam(py::module_& module);
void bind_merge(py::module_& module);
void bind_localization(py::module_& module);
void bind_evaluation(py::module_& module);
void bind_run(py::module_& module);
void bind_init(py::module_& module);
void bind_squares(py::module_& module);
void bind_live(py::module_& module);
void bind_smoother(py::module_& module);

/// A recording, and how it was read.
struct RecordingFile {
  Recording recording;
  ReadOptions reading;
  std::string path = {};  ///< that gives it again, without options; empty: none does
};

/// A path that an argument gives. TypeError where it is something else than `expected`.
std::filesystem::path path_of(const char* argument, const py::handle& given, const char* expected);

/// A robot, or the path of its file.
RobotFile robot_given(const py::handle& given);

/// Its recording, which may be long.
inline Recording copy_of(const RecordingFile& file) {
  return without_gil([&] { return file.recording; });
}

/// Recordings, or the paths of folders that hold some: what a command takes as RECORDING...
std::vector<Recording> recordings_of(const char* argument, const py::iterable& runs);

/// Recordings without slip, or their paths, for the question that learns from them.
void take_clean(const py::iterable& learn, SlipQuestion& question);
/// What --correct-slip, --learn and --spin-odds say.
std::optional<SlipQuestion> slip_question_of(const RecordingFile& recording, bool correct_slip,
                                             const py::iterable& learn, double spin_odds);

/// A JSON document as Python's own values: numbers keep their bits.
py::object python_of(const nlohmann::ordered_json& document);

/// X, Y and heading in degrees, as --start has them.
using StartTuple = std::tuple<double, double, double>;
struct Start {
  Pose2 pose;
  std::string text = "0,0,0";
};
/// Throws InputError where it is no pose.
Start start_of(const std::optional<StartTuple>& start);

/// As the program's options are checked: throws InputError where the value is not from `low` to `high`.
void require_from(const char* name, double value, double low, double high);
inline constexpr double kSmallest = 1e-12;
inline constexpr double kLargest = 1e9;

/// What a command with --json prints, and an attribute of every result.
template <class Class, class Document>
void add_document(Class& bound, Document document) {
  bound.def(
      "to_dict", [document](const typename Class::type& result) { return python_of(document(result)); },
      "What the command prints with --json, as dictionaries and lists.");
}

/// The same files, whose long texts end where a signal comes while they are written.
std::vector<OutputFile> interruptible(std::vector<OutputFile> files);

/// Writes what `files()` gives, all of it without the GIL. A signal leaves the places as they were.
template <class Files>
void save(const Files& files, const Provenance& provenance) {
  without_gil([&] {
    const std::vector<OutputFile> made = interruptible(files());
    check_interruption();
    write_files(made, provenance.inputs);
  });
}

/// Of results whose command has a document and no file of its own.
template <class Class, class Document>
void add_save_of_document(Class& bound, Document document, const char* what) {
  bound.def(
      "save",
      [document](const typename Class::type& result, const std::filesystem::path& path) {
        const auto files = [&] {
          return std::vector<OutputFile>{{path, dumped(document(result), 2) + "\n"}};
        };
        save(files, result.provenance);
      },
      py::arg("path"), what);
}

/// Methods that `trundle.<module>` has, of packages that are slow to import: those are imported when they are
/// called.
template <class Class>
void add_python_methods(Class& bound, const char* table_of_columns) {
  const auto forward = [](const char* module, const char* function) {
    return [module, function](const py::object& self, const py::args& args, const py::kwargs& named) {
      return py::module_::import(module).attr(function)(self, *args, **named);
    };
  };
  if (table_of_columns != nullptr)
    bound.def("to_pandas", forward("trundle.frames", "to_pandas"), table_of_columns);
  bound.def("plot", forward("trundle.plotting", "plot"),
            "Draws it with matplotlib, in a new figure or in the axes that are given, and returns the axes.");
  bound.def("_repr_html_", forward("trundle.html", "repr_html"));
  // Who copies what does not change gets the same.
  bound.def("__copy__", [](const py::object& self) { return self; });
  bound.def(
      "__deepcopy__", [](const py::object& self, const py::dict&) { return self; }, py::arg("memo"));
}

}  // namespace trundle::python
