#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "trundle/io/error.hpp"
#include "trundle/io/words.hpp"
#include "trundle/report/json_text.hpp"
#include "trundle/report/provenance.hpp"

#include "binding.hpp"
#include "call.hpp"

namespace trundle::python {
namespace {

/// The line that the program would end with: a ValueError where the input is wrong, CannotAnswer where it
/// does not suffice.
void translate_errors(py::module_& module) {
  static PyObject* cannot_answer = nullptr;
  cannot_answer = py::exception<CannotAnswer>(module, "CannotAnswer", PyExc_RuntimeError).release().ptr();
  module.attr("CannotAnswer").attr("__doc__") = "The data are well-formed, but cannot answer what was asked.";
  py::register_exception_translator([](std::exception_ptr pointer) {
    try {
      if (pointer) std::rethrow_exception(pointer);
    } catch (const py::builtin_exception&) {
      throw;
    } catch (const py::error_already_set&) {
      throw;
    } catch (const std::exception& error) {
      const ExitCode code = exit_code_of(error);
      if (code != kBadInput && code != kCannotAnswer) throw;
      PyErr_SetString(code == kBadInput ? PyExc_ValueError : cannot_answer, one_line(error.what()).c_str());
    }
  });
}

/// Beyond it a double tells no millimetres, and nothing on Earth is there.
constexpr double kFarthest = 1e8;

}  // namespace

py::object python_of(const nlohmann::ordered_json& document) {
  return py::module_::import("json").attr("loads")(dumped(document));
}

std::filesystem::path path_of(const char* argument, const py::handle& given, const char* expected) {
  try {
    return given.cast<std::filesystem::path>();
  } catch (const py::cast_error&) {
    const auto type = py::str(py::type::handle_of(given).attr("__name__")).cast<std::string>();
    throw py::type_error(fmt::format("{}: is of type {}; expected {}", argument, type, expected));
  }
}

RobotFile robot_given(const py::handle& given) {
  if (py::isinstance<RobotFile>(given)) return given.cast<const RobotFile&>();
  const std::filesystem::path path = path_of("robot", given, "a Robot, or the path of its file");
  return without_gil([&] { return read_robot_file(path); });
}

std::vector<OutputFile> interruptible(std::vector<OutputFile> files) {
  for (OutputFile& file : files)
    if (file.rest)
      file.rest = [rest = std::move(file.rest)](const TakeText& take) {
        rest([&](std::string_view piece) {
          check_interruption();
          take(piece);
        });
      };
  return files;
}

Start start_of(const std::optional<StartTuple>& start) {
  if (!start) return {};
  const auto [x, y, heading_deg] = *start;
  for (const double number : {x, y, heading_deg})
    if (!(std::abs(number) <= kFarthest))
      throw InputError("start", fmt::format("({}, {}, {}) is no pose", x, y, heading_deg),
                       fmt::format("x, y and heading [m, m, degrees] within ±{:g}", kFarthest));
  return {{x, y, radians(heading_deg)}, fmt::format("{},{},{}", x, y, heading_deg)};
}

void require_from(const char* name, double value, double low, double high) {
  if (!(value >= low && value <= high))
    throw InputError(name, fmt::format("is {}", value), fmt::format("a number from {:g} to {:g}", low, high));
}

}  // namespace trundle::python

PYBIND11_MODULE(_trundle, module) {
  using namespace trundle::python;
  py::options options;
  options.disable_function_signatures();
  module.attr("__version__") = trundle::report::program_version();
  translate_errors(module);
  bind_trajectory(module);
  bind_recording(module);
  bind_robot(module);
  bind_calibration(module);
  bind_odometry(module);
  bind_slip(module);
  bind_slam(module);
  bind_merge(module);
  bind_localization(module);
  bind_evaluation(module);
  bind_run(module);
  bind_init(module);
  bind_squares(module);
  bind_live(module);
  bind_smoother(module);
}
