#include "trundle/report/calibration_json.hpp"

#include <nlohmann/json.hpp>

#include "trundle/report/calibration_parts.hpp"

namespace trundle {
namespace {

using Json = nlohmann::ordered_json;

const char* name_of(CalibrationStatus status) {
  switch (status) {
    case CalibrationStatus::all_estimated:
      return "all_estimated";
    case CalibrationStatus::some_held:
      return "some_held";
    case CalibrationStatus::nothing_estimated:
      break;
  }
  return "nothing_estimated";
}

Json json_of(const std::optional<double>& number) {
  return number ? Json(*number) : Json(nullptr);
}

Json e_max_json(const CalibrationResult& result) {
  if (!result.e_max_before_m && !result.e_max_after_m) return nullptr;
  return {{"before_m", json_of(result.e_max_before_m)},
          {"after_m", json_of(result.e_max_after_m)},
          {"after_meaning", result.after_meaning}};
}

/// What JSON cannot say becomes what it can: numbers that are not finite null, bytes that are not UTF-8
/// U+FFFD.
Json representable(const Json& document) {
  return Json::parse(document.dump(-1, ' ', false, Json::error_handler_t::replace));
}

}  // namespace

Json calibration_json(const CalibrationResult& result, const Json& provenance) {
  Json document = {{"format", kCalibrationFormat},
                   {"format_version", kCalibrationFormatVersion},
                   {"provenance", provenance},
                   {"robot", {{"name", result.nominal.name}, {"wheels", result.nominal.wheel_names}}},
                   {"status", name_of(result.status)},
                   {"method", result.method},
                   {"summary", result.summary},
                   {"sessions", result.sessions},
                   {"warnings", result.warnings},
                   {"notes", result.notes},
                   {"cannot_tell", result.unobservable}};
  document["e_max"] = e_max_json(result);
  document["errors"] = errors_json(result.runs);
  document["parameters"] = parameters_json(result);
  document["correlation"] = correlation_json(result);
  document["influence"] = influence_json(result);
  document["directions"] = directions_json(result);
  document["end_points"] = end_points_json(result.runs);
  document["runs"] = runs_json(result.runs);
  return representable(document);
}

}  // namespace trundle
