#pragma once

#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "trundle/recording/recording.hpp"
#include "trundle/report/provenance.hpp"

namespace trundle::pipeline {

/// "warning" or "note".
const char* word_of(Severity severity);
nlohmann::ordered_json to_json(const Finding& problem);
nlohmann::ordered_json to_json(const std::vector<Finding>& findings);

}  // namespace trundle::pipeline
