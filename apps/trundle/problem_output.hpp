#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "trundle/recording/recording.hpp"

namespace trundle::app {

nlohmann::ordered_json to_json(const Problem& problem);
/// "warning: place: message" and a line end.
std::string line_of(const Problem& problem);

}  // namespace trundle::app
