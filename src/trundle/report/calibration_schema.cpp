#include <algorithm>
#include <array>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "trundle/io/error.hpp"
#include "trundle/report/calibration_json.hpp"

namespace trundle {
namespace {

using Json = nlohmann::ordered_json;

enum Type : unsigned { kString = 1, kNumber = 2, kBool = 4, kArray = 8, kObject = 16, kNull = 32 };

struct Rule {
  std::string_view path;  ///< keys from the root; "*": every element
  unsigned types;         ///< any of these
};

/// docs/calibration-json.md as a table. A rule is skipped where an earlier one found null.
constexpr std::array kRules = {
    Rule{"provenance", kObject},
    Rule{"robot", kObject},
    Rule{"robot/name", kString},
    Rule{"status", kString},
    Rule{"method", kString},
    Rule{"summary", kString},
    Rule{"sessions", kNumber},
    Rule{"warnings", kArray},
    Rule{"warnings/*", kString},
    Rule{"notes", kArray},
    Rule{"notes/*", kString},
    Rule{"cannot_tell", kArray},
    Rule{"cannot_tell/*", kString},
    Rule{"e_max", kObject | kNull},
    Rule{"e_max/before_m", kNumber | kNull},
    Rule{"e_max/after_m", kNumber | kNull},
    Rule{"e_max/after_meaning", kString},
    Rule{"errors", kObject},
    Rule{"errors/training", kObject | kNull},
    Rule{"errors/training/runs", kNumber},
    Rule{"errors/training/before", kObject},
    Rule{"errors/training/after", kObject | kNull},
    Rule{"errors/hold_out", kObject | kNull},
    Rule{"errors/hold_out/runs", kNumber},
    Rule{"errors/hold_out/before", kObject},
    Rule{"errors/hold_out/after", kObject | kNull},
    Rule{"parameters", kArray},
    Rule{"parameters/*", kObject},
    Rule{"parameters/*/name", kString},
    Rule{"parameters/*/unit", kString},
    Rule{"parameters/*/nominal", kNumber | kNull},
    Rule{"parameters/*/value", kNumber | kNull},
    Rule{"parameters/*/observable", kBool},
    Rule{"parameters/*/sigma_within", kNumber | kNull},
    Rule{"parameters/*/sigma_between", kNumber | kNull},
    Rule{"parameters/*/sigma_total", kNumber | kNull},
    Rule{"parameters/*/interval95_within", kArray | kNull},
    Rule{"parameters/*/interval95_within/*", kNumber},
    Rule{"parameters/*/interval95_between", kArray | kNull},
    Rule{"parameters/*/interval95_between/*", kNumber},
    Rule{"parameters/*/sigmas_from_nominal", kNumber | kNull},
    Rule{"parameters/*/sigma_data", kNumber | kNull},
    Rule{"parameters/*/sigma_prior", kNumber | kNull},
    Rule{"parameters/*/reason_held", kString | kNull},
    Rule{"correlation", kObject},
    Rule{"correlation/names", kArray},
    Rule{"correlation/names/*", kString},
    Rule{"correlation/within", kArray},
    Rule{"correlation/within/*", kArray},
    Rule{"correlation/within/*/*", kNumber | kNull},
    Rule{"correlation/total", kArray},
    Rule{"correlation/total/*", kArray},
    Rule{"correlation/total/*/*", kNumber | kNull},
    Rule{"directions", kArray},
    Rule{"directions/*", kObject},
    Rule{"directions/*/words", kString},
    Rule{"directions/*/singular_value", kNumber | kNull},
    Rule{"directions/*/log10_singular_value", kNumber | kNull},
    Rule{"directions/*/told", kBool},
    Rule{"end_points", kArray},
    Rule{"end_points/*", kObject},
    Rule{"end_points/*/turn", kString},
    Rule{"end_points/*/hold_out", kBool},
    Rule{"end_points/*/before", kObject},
    Rule{"end_points/*/before/run", kArray},
    Rule{"end_points/*/before/run/*", kNumber},
    Rule{"end_points/*/before/x_m", kArray},
    Rule{"end_points/*/before/x_m/*", kNumber | kNull},
    Rule{"end_points/*/before/y_m", kArray},
    Rule{"end_points/*/before/y_m/*", kNumber | kNull},
    Rule{"end_points/*/before/centroid_x_m", kNumber | kNull},
    Rule{"end_points/*/before/centroid_y_m", kNumber | kNull},
    Rule{"end_points/*/before/ellipse95", kObject | kNull},
    Rule{"end_points/*/after", kObject | kNull},
    Rule{"end_points/*/after/run", kArray},
    Rule{"end_points/*/after/run/*", kNumber},
    Rule{"end_points/*/after/x_m", kArray},
    Rule{"end_points/*/after/x_m/*", kNumber | kNull},
    Rule{"end_points/*/after/y_m", kArray},
    Rule{"end_points/*/after/y_m/*", kNumber | kNull},
    Rule{"end_points/*/after/centroid_x_m", kNumber | kNull},
    Rule{"end_points/*/after/centroid_y_m", kNumber | kNull},
    Rule{"end_points/*/after/ellipse95", kObject | kNull},
    Rule{"runs", kArray},
    Rule{"runs/*", kObject},
    Rule{"runs/*/name", kString},
    Rule{"runs/*/session", kString},
    Rule{"runs/*/hold_out", kBool},
    Rule{"runs/*/turn", kString},
    Rule{"runs/*/weight", kNumber | kNull},
    Rule{"runs/*/outlier", kBool},
    Rule{"runs/*/chi2_per_dof", kNumber | kNull},
    Rule{"runs/*/remark", kString},
    Rule{"runs/*/before", kObject | kNull},
    Rule{"runs/*/before/position_rms_m", kNumber | kNull},
    Rule{"runs/*/before/position_max_m", kNumber | kNull},
    Rule{"runs/*/after", kObject | kNull},
    Rule{"runs/*/after/position_rms_m", kNumber | kNull},
    Rule{"runs/*/after/position_max_m", kNumber | kNull},
    Rule{"runs/*/nees", kNumber | kNull},
    Rule{"runs/*/nees_white_only", kNumber | kNull},
    Rule{"runs/*/trajectories", kObject | kNull},
    Rule{"runs/*/trajectories/nominal", kObject},
    Rule{"runs/*/trajectories/nominal/x_m", kArray},
    Rule{"runs/*/trajectories/nominal/x_m/*", kNumber | kNull},
    Rule{"runs/*/trajectories/nominal/y_m", kArray},
    Rule{"runs/*/trajectories/nominal/y_m/*", kNumber | kNull},
    Rule{"runs/*/trajectories/calibrated", kObject},
    Rule{"runs/*/trajectories/calibrated/x_m", kArray},
    Rule{"runs/*/trajectories/calibrated/x_m/*", kNumber | kNull},
    Rule{"runs/*/trajectories/calibrated/y_m", kArray},
    Rule{"runs/*/trajectories/calibrated/y_m/*", kNumber | kNull},
    Rule{"runs/*/trajectories/reference", kObject},
    Rule{"runs/*/trajectories/reference/x_m", kArray},
    Rule{"runs/*/trajectories/reference/x_m/*", kNumber | kNull},
    Rule{"runs/*/trajectories/reference/y_m", kArray},
    Rule{"runs/*/trajectories/reference/y_m/*", kNumber | kNull},
    Rule{"runs/*/deviation", kObject | kNull},
    Rule{"runs/*/deviation/path_m", kArray},
    Rule{"runs/*/deviation/path_m/*", kNumber | kNull},
    Rule{"runs/*/deviation/nominal_m", kArray},
    Rule{"runs/*/deviation/nominal_m/*", kNumber | kNull},
    Rule{"runs/*/deviation/calibrated_m", kArray},
    Rule{"runs/*/deviation/calibrated_m/*", kNumber | kNull},
};

constexpr std::array<std::pair<Type, std::string_view>, 6> kTypeNames = {{{kString, "a string"},
                                                                          {kNumber, "a number"},
                                                                          {kBool, "true or false"},
                                                                          {kArray, "an array"},
                                                                          {kObject, "an object"},
                                                                          {kNull, "null"}}};

Type type_of(const Json& value) {
  if (value.is_string()) return kString;
  if (value.is_number()) return kNumber;
  if (value.is_boolean()) return kBool;
  if (value.is_array()) return kArray;
  return value.is_object() ? kObject : kNull;
}

std::string in_words(unsigned types) {
  std::string text;
  for (const auto& [type, name] : kTypeNames)
    if ((types & type) != 0) text += (text.empty() ? "" : " or ") + std::string(name);
  return text;
}

/// Follows one rule into a document and throws where a value is missing or of another type.
class RuleCheck {
 public:
  RuleCheck(std::string_view file_name, unsigned types) : file_name_(file_name), types_(types) {}

  void follow(const Json& value, std::string_view rest, const std::string& where) const {
    if (rest.empty()) return expect_type(value, where);
    if (value.is_null()) return;
    const std::string_view key = rest.substr(0, rest.find('/'));
    const std::string_view next =
        key.size() == rest.size() ? std::string_view() : rest.substr(key.size() + 1);
    if (key != "*") return follow_key(value, std::string(key), next, where);
    for (std::size_t i = 0; i < value.size(); ++i) follow(value[i], next, fmt::format("{}[{}]", where, i));
  }

 private:
  void follow_key(const Json& value, const std::string& key, std::string_view next,
                  const std::string& where) const {
    const std::string path = where.empty() ? key : where + "." + key;
    const auto found = value.find(key);
    if (found == value.end())
      throw InputError(file_name_, fmt::format("\"{}\" is missing", path), in_words(types_));
    follow(*found, next, path);
  }

  void expect_type(const Json& value, const std::string& where) const {
    const Type type = type_of(value);
    if ((types_ & type) == 0)
      throw InputError(file_name_, fmt::format("\"{}\" is {}", where, in_words(type)), in_words(types_));
  }

  std::string_view file_name_;
  unsigned types_;
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

Json parse(std::string_view text, std::string_view file_name) {
  try {
    return Json::parse(text);
  } catch (const Json::parse_error& error) {
    const std::size_t end = std::min(error.byte, text.size());
    const std::size_t line = 1 + static_cast<std::size_t>(std::count(
                                     text.begin(), text.begin() + static_cast<std::ptrdiff_t>(end), '\n'));
    throw InputError(place(file_name, line), "is not JSON here",
                     "a calibration.json as trundle calibrate writes it");
  }
}

}  // namespace

Json parse_calibration_json(std::string_view text, std::string_view file_name) {
  Json document = parse(text, file_name);
  expect_format(document, file_name);
  for (const Rule& rule : kRules) RuleCheck(file_name, rule.types).follow(document, rule.path, "");
  expect_consistent_sizes(document, file_name);
  return document;
}

}  // namespace trundle
