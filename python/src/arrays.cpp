#include "arrays.hpp"

#include <cmath>

#include <fmt/format.h>
#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include "trundle/io/error.hpp"

#include "binding.hpp"

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

/// Whole numbers are floats in an array of which one is missing: 1.0 is the landmark '1'.
std::string name_in(const py::handle& value) {
  const bool is_whole = py::hasattr(value, "is_integer") && value.attr("is_integer")().cast<bool>();
  return is_whole ? text_of(py::int_(py::reinterpret_borrow<py::object>(value))) : text_of(value);
}

std::vector<std::string> texts_of(const Column& column) {
  std::vector<std::string> texts;
  for (const py::handle& value : array_of(column, true))
    texts.push_back(is_missing(value) ? "" : name_in(value));
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

}  // namespace

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

}  // namespace trundle::python
