// What arguments give, checked as the program checks its options; and what results are made of.
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "trundle/io/error.hpp"
#include "trundle/report/json_text.hpp"

#include "binding.hpp"
#include "call.hpp"

namespace trundle::python {
namespace {

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
  return by_library([&] { return read_robot_file(path); });
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
