#include "trundle/report/calibration_json.hpp"

#include <algorithm>

#include <nlohmann/json.hpp>

#include "trundle/report/calibration_parts.hpp"
#include "trundle/report/json_text.hpp"
#include "trundle/report/or_null.hpp"

namespace trundle::report {
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

Json e_max_json(const CalibrationResult& result) {
  if (!result.e_max_before_m && !result.e_max_after_m) return nullptr;
  return {{"before_m", or_null(result.e_max_before_m)},
          {"after_m", or_null(result.e_max_after_m)},
          {"after_meaning", result.after_meaning}};
}

Json offers_json(std::span<const ParameterOffer> offers) {
  Json list = Json::array();
  for (const ParameterOffer& offer : offers)
    list.push_back({{"name", offer.name},
                    {"value", offer.value},
                    {"sigma", offer.sigma},
                    {"log_likelihood_gain", offer.gain},
                    {"parts", offer.parts},
                    {"of_halves", offer.of_halves}});
  return list;
}

/// The note of a corrected clock, which begins with the key of the robot file, is all that the document says.
bool says_what_was_set(const Json& document, std::string_view clock) {
  return std::ranges::any_of(document.at("notes"),
                             [&](const Json& note) { return note.get<std::string>().starts_with(clock); });
}

/// What JSON cannot say becomes what it can: numbers that are not finite null, bytes that are not UTF-8
/// U+FFFD.
Json representable(const Json& document) {
  return Json::parse(dumped(document));
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
  if (const auto& judged = result.cross_validation)
    document["cross_validation"] = {{"parts", judged->parts},
                                    {"of_halves", judged->of_halves},
                                    {"given_m", judged->given_m},
                                    {"calibrated_m", judged->calibrated_m},
                                    {"pull_sigma", judged->pull_sigma}};
  if (!result.offers.empty()) document["offers"] = offers_json(result.offers);
  document["parameters"] = parameters_json(result);
  document["correlation"] = correlation_json(result);
  document["influence"] = influence_json(result);
  document["directions"] = directions_json(result);
  document["end_points"] = end_points_json(result.runs);
  document["runs"] = runs_json(result.runs);
  return representable(document);
}

CalibrationDocument calibration_document(const CalibrationResult& result, const Json& provenance) {
  return {.document = calibration_json(result, provenance),
          .sets_gyro_clock = result.gyro_clock.has_value(),
          .sets_steering_clock = result.steering_clock.has_value()};
}

CalibrationDocument calibration_from_json(std::string_view text, std::string_view file_name) {
  CalibrationDocument calibration{.document = parse_calibration_json(text, file_name)};
  calibration.sets_gyro_clock = says_what_was_set(calibration.document, "gyro.time_offset_s");
  calibration.sets_steering_clock = says_what_was_set(calibration.document, "steering_time_offset_s");
  return calibration;
}

}  // namespace trundle::report
