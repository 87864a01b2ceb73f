#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "trundle/namespaces.hpp"

namespace trundle::report {

/// JSON to read and to compare by lines: one key on each line, indented by two, but an array of plain values
/// on one line. Ends with a newline. Parses back to the same value.
std::string json_text(const nlohmann::ordered_json& document);

/// As dump() writes it, every control character escaped; text that is not UTF-8, of a path or a column, is
/// repaired.
std::string dumped(const nlohmann::ordered_json& document, int indent = -1);

}  // namespace trundle::report
