#include <algorithm>
#include <array>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "trundle/io/error.hpp"
#include "trundle/report/calibration_json.hpp"
#include "trundle/report/json_rules.hpp"

namespace trundle::report {
namespace {

using Json = nlohmann::ordered_json;

/// docs/calibration-json.md as a table. A rule is skipped where an earlier one found null.
constexpr std::array kRules = {
    JsonRule{"provenance", kObject},
    JsonRule{"robot", kObject},
    JsonRule{"robot/name", kString},
    JsonRule{"status", kString},
    JsonRule{"method", kString},
    JsonRule{"summary", kString},
    JsonRule{"sessions", kNumber},
    JsonRule{"warnings", kArray},
    JsonRule{"warnings/*", kString},
    JsonRule{"notes", kArray},
    JsonRule{"notes/*", kString},
    JsonRule{"cannot_tell", kArray},
    JsonRule{"cannot_tell/*", kString},
    JsonRule{"e_max", kObject | kNull},
    JsonRule{"e_max/before_m", kNumber | kNull},
    JsonRule{"e_max/after_m", kNumber | kNull},
    JsonRule{"e_max/after_meaning", kString},
    JsonRule{"errors", kObject},
    JsonRule{"errors/training", kObject | kNull},
    JsonRule{"errors/training/runs", kNumber},
    JsonRule{"errors/training/before", kObject},
    JsonRule{"errors/training/after", kObject | kNull},
    JsonRule{"errors/hold_out", kObject | kNull},
    JsonRule{"errors/hold_out/runs", kNumber},
    JsonRule{"errors/hold_out/before", kObject},
    JsonRule{"errors/hold_out/after", kObject | kNull},
    JsonRule{"parameters", kArray},
    JsonRule{"parameters/*", kObject},
    JsonRule{"parameters/*/name", kString},
    JsonRule{"parameters/*/unit", kString},
    JsonRule{"parameters/*/nominal", kNumber | kNull},
    JsonRule{"parameters/*/value", kNumber | kNull},
    JsonRule{"parameters/*/observable", kBool},
    JsonRule{"parameters/*/sigma_within", kNumber | kNull},
    JsonRule{"parameters/*/sigma_between", kNumber | kNull},
    JsonRule{"parameters/*/sigma_total", kNumber | kNull},
    JsonRule{"parameters/*/interval95_within", kArray | kNull},
    JsonRule{"parameters/*/interval95_within/*", kNumber},
    JsonRule{"parameters/*/interval95_between", kArray | kNull},
    JsonRule{"parameters/*/interval95_between/*", kNumber},
    JsonRule{"parameters/*/sigmas_from_nominal", kNumber | kNull},
    JsonRule{"parameters/*/sigma_data", kNumber | kNull},
    JsonRule{"parameters/*/sigma_prior", kNumber | kNull},
    JsonRule{"parameters/*/reason_held", kString | kNull},
    JsonRule{"correlation", kObject},
    JsonRule{"correlation/names", kArray},
    JsonRule{"correlation/names/*", kString},
    JsonRule{"correlation/within", kArray},
    JsonRule{"correlation/within/*", kArray},
    JsonRule{"correlation/within/*/*", kNumber | kNull},
    JsonRule{"correlation/total", kArray},
    JsonRule{"correlation/total/*", kArray},
    JsonRule{"correlation/total/*/*", kNumber | kNull},
    JsonRule{"influence", kObject | kNull | kMissing},
    JsonRule{"influence/parameters", kArray},
    JsonRule{"influence/parameters/*", kObject},
    JsonRule{"influence/parameters/*/name", kString},
    JsonRule{"influence/parameters/*/without", kArray},
    JsonRule{"influence/parameters/*/without/*", kNumber | kNull},
    JsonRule{"influence/parameters/*/after", kArray},
    JsonRule{"influence/parameters/*/after/*", kNumber | kNull},
    JsonRule{"influence/parameters/*/sigma_after", kArray},
    JsonRule{"influence/parameters/*/sigma_after/*", kNumber | kNull},
    JsonRule{"directions", kArray},
    JsonRule{"directions/*", kObject},
    JsonRule{"directions/*/words", kString},
    JsonRule{"directions/*/singular_value", kNumber | kNull},
    JsonRule{"directions/*/log10_singular_value", kNumber | kNull},
    JsonRule{"directions/*/told", kBool},
    JsonRule{"end_points", kArray},
    JsonRule{"end_points/*", kObject},
    JsonRule{"end_points/*/turn", kString},
    JsonRule{"end_points/*/hold_out", kBool},
    JsonRule{"end_points/*/before", kObject},
    JsonRule{"end_points/*/before/run", kArray},
    JsonRule{"end_points/*/before/run/*", kNumber},
    JsonRule{"end_points/*/before/x_m", kArray},
    JsonRule{"end_points/*/before/x_m/*", kNumber | kNull},
    JsonRule{"end_points/*/before/y_m", kArray},
    JsonRule{"end_points/*/before/y_m/*", kNumber | kNull},
    JsonRule{"end_points/*/before/centroid_x_m", kNumber | kNull},
    JsonRule{"end_points/*/before/centroid_y_m", kNumber | kNull},
    JsonRule{"end_points/*/before/ellipse95", kObject | kNull},
    JsonRule{"end_points/*/after", kObject | kNull},
    JsonRule{"end_points/*/after/run", kArray},
    JsonRule{"end_points/*/after/run/*", kNumber},
    JsonRule{"end_points/*/after/x_m", kArray},
    JsonRule{"end_points/*/after/x_m/*", kNumber | kNull},
    JsonRule{"end_points/*/after/y_m", kArray},
    JsonRule{"end_points/*/after/y_m/*", kNumber | kNull},
    JsonRule{"end_points/*/after/centroid_x_m", kNumber | kNull},
    JsonRule{"end_points/*/after/centroid_y_m", kNumber | kNull},
    JsonRule{"end_points/*/after/ellipse95", kObject | kNull},
    JsonRule{"runs", kArray},
    JsonRule{"runs/*", kObject},
    JsonRule{"runs/*/name", kString},
    JsonRule{"runs/*/session", kString},
    JsonRule{"runs/*/hold_out", kBool},
    JsonRule{"runs/*/turn", kString},
    JsonRule{"runs/*/weight", kNumber | kNull},
    JsonRule{"runs/*/outlier", kBool},
    JsonRule{"runs/*/chi2_per_dof", kNumber | kNull},
    JsonRule{"runs/*/remark", kString},
    JsonRule{"runs/*/before", kObject | kNull},
    JsonRule{"runs/*/before/position_rms_m", kNumber | kNull},
    JsonRule{"runs/*/before/position_max_m", kNumber | kNull},
    JsonRule{"runs/*/after", kObject | kNull},
    JsonRule{"runs/*/after/position_rms_m", kNumber | kNull},
    JsonRule{"runs/*/after/position_max_m", kNumber | kNull},
    JsonRule{"runs/*/nees", kNumber | kNull},
    JsonRule{"runs/*/nees_white_only", kNumber | kNull},
    JsonRule{"runs/*/trajectories", kObject | kNull},
    JsonRule{"runs/*/trajectories/nominal", kObject},
    JsonRule{"runs/*/trajectories/nominal/x_m", kArray},
    JsonRule{"runs/*/trajectories/nominal/x_m/*", kNumber | kNull},
    JsonRule{"runs/*/trajectories/nominal/y_m", kArray},
    JsonRule{"runs/*/trajectories/nominal/y_m/*", kNumber | kNull},
    JsonRule{"runs/*/trajectories/calibrated", kObject},
    JsonRule{"runs/*/trajectories/calibrated/x_m", kArray},
    JsonRule{"runs/*/trajectories/calibrated/x_m/*", kNumber | kNull},
    JsonRule{"runs/*/trajectories/calibrated/y_m", kArray},
    JsonRule{"runs/*/trajectories/calibrated/y_m/*", kNumber | kNull},
    JsonRule{"runs/*/trajectories/reference", kObject},
    JsonRule{"runs/*/trajectories/reference/x_m", kArray},
    JsonRule{"runs/*/trajectories/reference/x_m/*", kNumber | kNull},
    JsonRule{"runs/*/trajectories/reference/y_m", kArray},
    JsonRule{"runs/*/trajectories/reference/y_m/*", kNumber | kNull},
    JsonRule{"runs/*/deviation", kObject | kNull},
    JsonRule{"runs/*/deviation/path_m", kArray},
    JsonRule{"runs/*/deviation/path_m/*", kNumber | kNull},
    JsonRule{"runs/*/deviation/nominal_m", kArray},
    JsonRule{"runs/*/deviation/nominal_m/*", kNumber | kNull},
    JsonRule{"runs/*/deviation/calibrated_m", kArray},
    JsonRule{"runs/*/deviation/calibrated_m/*", kNumber | kNull},
};

void expect_format(const Json& document, std::string_view file_name) {
  const std::string expected =
      fmt::format("\"format\": \"{}\", the output of trundle calibrate", kCalibrationFormat);
  if (!document.is_object()) throw InputError(file_name, "is JSON but not an object", expected);
  const auto format = document.find("format");
  if (format == document.end()) throw InputError(file_name, "\"format\" is missing", expected);
  if (*format != kCalibrationFormat) throw InputError(file_name, "\"format\" is something else", expected);
  const auto version = document.find("format_version");
  if (version == document.end() || *version != kCalibrationFormatVersion)
    throw InputError(file_name, "\"format_version\" is missing or of another program version",
                     fmt::format("{}", kCalibrationFormatVersion));
}

void expect_same_length(const Json& object, std::string_view file_name, const std::string& where) {
  if (object.is_null()) return;
  if (object.at("x_m").size() != object.at("y_m").size())
    throw InputError(
        file_name,
        fmt::format("\"{}\" has {} x_m and {} y_m", where, object.at("x_m").size(), object.at("y_m").size()),
        "as many of the one as of the other");
}

void expect_square(const Json& rows, std::size_t size, std::string_view file_name, const char* where) {
  const bool square =
      rows.size() == size && std::ranges::all_of(rows, [&](const Json& row) { return row.size() == size; });
  if (!square && !rows.empty())
    throw InputError(file_name, fmt::format("\"{}\" has another size than \"correlation.names\"", where),
                     fmt::format("{0} rows of {0} numbers, or none", size));
}

void expect_two_ends(const Json& parameter, std::string_view file_name, std::size_t index) {
  for (const char* name : {"interval95_within", "interval95_between"})
    if (const Json& ends = parameter.at(name); !ends.is_null() && ends.size() != 2)
      throw InputError(file_name,
                       fmt::format("\"parameters[{}].{}\" has {} numbers", index, name, ends.size()), "2");
}

void expect_consistent_sizes(const Json& document, std::string_view file_name) {
  const Json& correlation = document.at("correlation");
  const std::size_t names = correlation.at("names").size();
  expect_square(correlation.at("within"), names, file_name, "correlation.within");
  expect_square(correlation.at("total"), names, file_name, "correlation.total");
  for (std::size_t i = 0; const Json& parameter : document.at("parameters"))
    expect_two_ends(parameter, file_name, i++);
  for (std::size_t i = 0; const Json& group : document.at("end_points")) {
    expect_same_length(group.at("before"), file_name, fmt::format("end_points[{}].before", i));
    expect_same_length(group.at("after"), file_name, fmt::format("end_points[{}].after", i++));
  }
  for (std::size_t i = 0; const Json& run : document.at("runs")) {
    const std::size_t index = i++;
    if (run.at("trajectories").is_null()) continue;
    for (const char* name : {"nominal", "calibrated", "reference"})
      expect_same_length(run.at("trajectories").at(name), file_name,
                         fmt::format("runs[{}].trajectories.{}", index, name));
  }
}

}  // namespace

Json parse_calibration_json(std::string_view text, std::string_view file_name) {
  Json document = parse_json(text, file_name, "a calibration.json as trundle calibrate writes it");
  expect_format(document, file_name);
  check_rules(document, kRules, file_name);
  expect_consistent_sizes(document, file_name);
  return document;
}

}  // namespace trundle::report
