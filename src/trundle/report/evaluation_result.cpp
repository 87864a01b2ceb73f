#include "trundle/report/evaluation_result.hpp"

#include <array>

#include <nlohmann/json.hpp>

#include "trundle/report/json_rules.hpp"

namespace trundle::report {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::array kEvaluationRules = {
    JsonRule{"alignment", kObject | kMissing},
    JsonRule{"alignment/kind", kString | kMissing},
    JsonRule{"reference_noise", kObject | kNull | kMissing},
    JsonRule{"reference_noise/position_sigma_m", kNumber | kMissing},
    JsonRule{"reference_noise/heading_sigma_rad", kNumber | kMissing},
};

Alignment alignment_in(const Json& document) {
  const Json kind = document.value("/alignment/kind"_json_pointer, Json());
  for (const Alignment alignment : {Alignment::none, Alignment::se2})
    if (kind == name_of(alignment)) return alignment;
  return Alignment::start;
}

}  // namespace

Json to_json(const ReferenceSigmas& noise) {
  if (!noise.stated()) return nullptr;
  return {{"position_sigma_m", noise.position_sigma_m}, {"heading_sigma_rad", noise.heading_sigma_rad}};
}

Json to_json(const EvaluationSummary& summary) {
  return {{"alignment", {{"kind", name_of(summary.alignment)}}}, {"reference_noise", to_json(summary.noise)}};
}

EvaluationSummary evaluation_from_json(std::string_view text, std::string_view file_name) {
  const Json document = parse_result(text, "evaluation", kEvaluationRules, file_name);
  EvaluationSummary summary{.alignment = alignment_in(document)};
  if (const Json noise = document.value("reference_noise", Json()); noise.is_object())
    summary.noise = {noise.value("position_sigma_m", 0.0), noise.value("heading_sigma_rad", 0.0)};
  return summary;
}

}  // namespace trundle::report
