#pragma once

#include <string_view>

#include <nlohmann/json_fwd.hpp>

#include "trundle/evaluation/evaluate.hpp"
#include "trundle/recording/reference_noise.hpp"

namespace trundle::report {

/// How evaluation.json compares the trajectories with each other.
struct EvaluationSummary {
  Alignment alignment = Alignment::start;
  ReferenceSigmas noise = {};  ///< of the reference
};

/// Null: the reference is taken as exact.
nlohmann::ordered_json to_json(const ReferenceSigmas& noise);
/// "alignment" and "reference_noise".
nlohmann::ordered_json to_json(const EvaluationSummary& summary);
/// Throws InputError with file, what stands there and what was expected.
EvaluationSummary evaluation_from_json(std::string_view text, std::string_view file_name);

}  // namespace trundle::report
