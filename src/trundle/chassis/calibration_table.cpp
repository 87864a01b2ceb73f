#include "trundle/chassis/detail/calibration_table.hpp"

#include <algorithm>

#include "trundle/chassis/parameter.hpp"
#include "trundle/geometry/decompositions.hpp"

namespace trundle::chassis::robot_file {
namespace {

// Rounding in the covariance of well-scaled parameters stays far below this share of their variances.
constexpr double kCovarianceTolerance = 1e-9;
// In place of 1/σ where σ is 0: its square is still a double, and any covariance beside it becomes a fault.
constexpr double kNoVariance = 1e100;

Parameter parameter_at(const Section& section, const std::string& name, const Robot& robot) {
  if (const auto parameter = parameter_named(name, robot)) return *parameter;
  std::vector<std::string> known;
  for (const Parameter& parameter : parameters_of(robot)) known.push_back(name_of(parameter, robot));
  const std::string meant = nearest_name(name, known);
  fail(section.source, section.table.get("name")->source(),
       fmt::format("this robot has no parameter \"{}\"", name),
       meant.empty() ? fmt::format("one of {}", fmt::join(known, ", ")) : fmt::format("\"{}\"", meant));
}

void check_unit(const Section& section, const CalibratedParameter& read, const Parameter& parameter) {
  if (read.unit == unit_of(parameter)) return;
  fail(section.source, section.table.get("unit")->source(),
       fmt::format("unit of {} is \"{}\"", read.name, read.unit), fmt::format("\"{}\"", unit_of(parameter)));
}

CalibratedParameter read_parameter(const Section& section, const Robot& robot) {
  static const std::vector<std::string> known{"name",         "unit",          "value",     "nominal",
                                              "sigma_within", "sigma_between", "observable"};
  check_keys(section, known);
  CalibratedParameter parameter;
  parameter.name = text(section, "name", "the name of a parameter, like \"left.diameter\"");
  parameter.unit = text(section, "unit", "its unit");
  check_unit(section, parameter, parameter_at(section, parameter.name, robot));
  required(section, "observable", kTruthExpected);
  parameter.observable = truth_value(section, "observable", false);
  read_numbers(section, kParameter, parameter);
  const toml::node& within = required(section, "sigma_within", kNotNegative.words);
  parameter.sigma_within =
      number(section.source, "sigma_within", within, kNotNegative, !parameter.observable);
  if (const toml::node* between = section.table.get("sigma_between"))
    parameter.sigma_between = number(section.source, "sigma_between", *between, kNotNegative);
  return parameter;
}

std::vector<CalibratedParameter> read_parameters(const Section& calibration, const Robot& robot) {
  std::vector<CalibratedParameter> parameters;
  for (const Section& section : tables(calibration, "parameter", "[[calibration.parameter]]")) {
    CalibratedParameter parameter = read_parameter(section, robot);
    if (std::ranges::find(parameters, parameter.name, &CalibratedParameter::name) != parameters.end())
      fail(section.source, section.table.source(), fmt::format("a second parameter \"{}\"", parameter.name),
           "each parameter once");
    parameters.push_back(std::move(parameter));
  }
  return parameters;
}

ErrorBeforeAfter read_error(const Section& section) {
  static const std::vector<std::string> known{"what", "before", "after", "unit"};
  check_keys(section, known);
  ErrorBeforeAfter error;
  error.what = text(section, "what", "what was measured");
  error.unit = text(section, "unit", "its unit");
  read_numbers(section, kError, error);
  return error;
}

void read_row(const Section& section, const toml::node& node, Eigen::Index row, Eigen::MatrixXd& covariance) {
  const toml::array* values = node.as_array();
  if (values == nullptr || static_cast<Eigen::Index>(values->size()) != covariance.cols())
    fail(section.source, node.source(),
         fmt::format("row {} of covariance is no array of that length", row + 1),
         fmt::format("an array of {} numbers", covariance.cols()));
  for (Eigen::Index column = 0; column < covariance.cols(); ++column)
    covariance(row, column) =
        number(section.source, "covariance", (*values)[static_cast<std::size_t>(column)], kAny);
}

/// Each entry divided by the sigmas of its row and column. What is beside a variance of 0 must be 0; anything
/// else becomes so large that the matrix is no covariance.
Eigen::MatrixXd correlation_of(const Eigen::MatrixXd& covariance) {
  const Eigen::ArrayXd sigma = covariance.diagonal().array().abs().sqrt();
  const Eigen::VectorXd scale = (sigma > 0.0).select(sigma.inverse(), kNoVariance);
  return scale.asDiagonal() * covariance * scale.asDiagonal();
}

void check_covariance(const Section& section, const toml::node& node, const Eigen::MatrixXd& covariance) {
  const Eigen::MatrixXd correlation = correlation_of(covariance);
  const Eigen::MatrixXd difference =
      (correlation - correlation.transpose()).cwiseAbs().cwiseQuotient(correlation.cwiseAbs().cwiseMax(1.0));
  Eigen::Index row = 0;
  Eigen::Index column = 0;
  if (difference.maxCoeff(&column, &row) >
      kCovarianceTolerance)  // of two mirrored entries the first is found
    fail(section.source, node.source(),
         fmt::format("covariance has {} at ({}, {}) and {} at ({}, {})", covariance(row, column), row + 1,
                     column + 1, covariance(column, row), column + 1, row + 1),
         "a symmetric matrix");
  if (symmetric_eigenvalues(correlation).minCoeff() <
      -kCovarianceTolerance * static_cast<double>(covariance.rows()))
    fail(section.source, node.source(), "covariance gives some combination of parameters a negative variance",
         "a positive semidefinite matrix");
}

/// Which parameters the covariance in the file is of: all observable ones, and of the others those that may
/// be wrong as given.
std::vector<Eigen::Index> covered(const Section& section, const CalibrationRecord& record) {
  const std::vector<std::string> names = texts(section, "covariance_of");
  const auto is_named = [&](const std::string& name) {
    return std::ranges::find(names, name) != names.end();
  };
  std::vector<Eigen::Index> indices;
  std::vector<std::string> in_order, observable;
  for (std::size_t i = 0; i < record.parameters.size(); ++i) {
    const CalibratedParameter& parameter = record.parameters[i];
    if (parameter.observable) observable.push_back(parameter.name);
    if (!is_named(parameter.name)) continue;
    indices.push_back(static_cast<Eigen::Index>(i));
    in_order.push_back(parameter.name);
  }
  if (names == in_order && std::ranges::all_of(observable, is_named)) return indices;
  const auto expected = fmt::format("parameters in their order, among them the observable ones: {}",
                                    fmt::join(observable, ", "));
  const toml::node& node = required(section, "covariance_of", expected);
  fail(section.source, node.source(), in(section, "covariance_of names others"), expected);
}

/// Of all parameters, zero where the file has none; it repeats their names so that a person can read it.
Eigen::MatrixXd read_covariance(const Section& section, const CalibrationRecord& record) {
  const std::vector<Eigen::Index> indices = covered(section, record);
  const auto n = std::ssize(indices);
  if (n == 0 && !section.table.contains("covariance")) return {};
  const std::string words = fmt::format("an array of {} arrays of {} numbers", n, n);
  const toml::node& node = required(section, "covariance", words);
  const toml::array* rows = node.as_array();
  if (rows == nullptr || static_cast<Eigen::Index>(rows->size()) != n)
    fail(section.source, node.source(), in(section, "covariance has another shape"), words);
  Eigen::MatrixXd covariance(n, n);
  for (Eigen::Index row = 0; row < n; ++row)
    read_row(section, (*rows)[static_cast<std::size_t>(row)], row, covariance);
  if (n > 0) check_covariance(section, node, covariance);
  const auto all = std::ssize(record.parameters);
  Eigen::MatrixXd of_all = Eigen::MatrixXd::Zero(all, all);
  of_all(indices, indices) = covariance;
  return of_all;
}

}  // namespace

CalibrationRecord read_calibration(const Section& section, const Robot& robot) {
  static const std::vector<std::string> known{"provenance", "parameter", "covariance_of", "covariance",
                                              "error"};
  check_keys(section, known);
  CalibrationRecord record;
  record.provenance = texts(section, "provenance");
  record.parameters = read_parameters(section, robot);
  record.covariance = read_covariance(section, record);
  for (const Section& error : tables(section, "error", "[[calibration.error]]"))
    record.errors.push_back(read_error(error));
  return record;
}

}  // namespace trundle::chassis::robot_file
