/// Columns of a stream from what Python holds: arrays, lists, DataFrames.
#pragma once

#include <string>

#include <pybind11/pybind11.h>

#include "trundle/recording/columns.hpp"

namespace trundle::python {

namespace py = pybind11;

/// The columns of a mapping: a dictionary of arrays, a DataFrame or a structured array. Throws TypeError
/// where it is none, and InputError where a value is no number.
recording::StreamColumns stream_of(const std::string& name, const py::object& columns);

}  // namespace trundle::python
