#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

namespace trundle {

/// JSON to read and to compare by lines: one key on each line, indented by two, but an array of plain values
/// on one line. Ends with a newline. Parses back to the same value.
std::string json_text(const nlohmann::ordered_json& document);

}  // namespace trundle
