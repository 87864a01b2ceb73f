/// NumPy arrays on the memory of C++ values: read-only, and each keeps the Python object alive whose memory
/// it shows.
#pragma once

#include <vector>

#include <Eigen/Core>
#include <pybind11/numpy.h>

namespace trundle::python {

namespace py = pybind11;

/// `first`: of numbers that lie so many bytes apart.
template <class Number>
py::array view(const py::handle& owner, const Number* first, std::vector<py::ssize_t> shape,
               std::vector<py::ssize_t> strides) {
  if (first == nullptr) {
    py::array none(py::dtype::of<Number>(), std::move(shape));
    py::detail::array_proxy(none.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
    return none;
  }
  py::array array(py::dtype::of<Number>(), std::move(shape), std::move(strides), first, owner);
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}

inline py::array view(const py::handle& owner, const std::vector<double>& values) {
  return view(owner, values.data(), {static_cast<py::ssize_t>(values.size())}, {sizeof(double)});
}

/// One number of each row: `number(row)` refers to it.
template <class Row, class Number>
py::array column(const py::handle& owner, const std::vector<Row>& rows, Number number) {
  const auto* const first = rows.empty() ? nullptr : &number(rows.front());
  return view(owner, first, {static_cast<py::ssize_t>(rows.size())}, {sizeof(Row)});
}

/// A vector or matrix of each row, whose Eigen type has a fixed size: (rows, n) or (rows, n, n).
template <class Row, class Matrix>
py::array matrices(const py::handle& owner, const std::vector<Row>& rows, Matrix matrix) {
  using Type = std::remove_cvref_t<decltype(matrix(rows.front()))>;
  const double* const first = rows.empty() ? nullptr : matrix(rows.front()).data();
  const auto count = static_cast<py::ssize_t>(rows.size());
  constexpr py::ssize_t kNumber = sizeof(double);
  if constexpr (Type::ColsAtCompileTime == 1)
    return view(owner, first, {count, Type::RowsAtCompileTime}, {sizeof(Row), kNumber});
  else
    return view(owner, first, {count, Type::RowsAtCompileTime, Type::ColsAtCompileTime},
                {sizeof(Row), kNumber, kNumber * Type::RowsAtCompileTime});
}

/// Eigen keeps columns together.
inline py::array view(const py::handle& owner, const Eigen::MatrixXd& matrix) {
  constexpr py::ssize_t kNumber = sizeof(double);
  return view(owner, matrix.data(), {matrix.rows(), matrix.cols()}, {kNumber, kNumber * matrix.rows()});
}
template <int kRows, int kCols>
py::array view(const py::handle& owner,
               const Eigen::Matrix<double, kRows, kCols>& matrix) requires(kRows > 1 && kCols > 1) {
  constexpr py::ssize_t kNumber = sizeof(double);
  return view(owner, matrix.data(), {kRows, kCols}, {kNumber, kNumber * kRows});
}

/// Of what is computed when it is asked for: an array of its own. A vector has one axis.
template <class Derived>
py::array copied(const Eigen::DenseBase<Derived>& matrix) {
  std::vector<py::ssize_t> shape = {matrix.rows()};
  if (Derived::ColsAtCompileTime != 1) shape.push_back(matrix.cols());
  py::array_t<double> array(std::move(shape));
  for (Eigen::Index i = 0; i < matrix.rows(); ++i)
    for (Eigen::Index j = 0; j < matrix.cols(); ++j)
      array.mutable_data()[i * matrix.cols() + j] = matrix(i, j);
  return array;
}

}  // namespace trundle::python
