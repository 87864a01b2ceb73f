#pragma once

#include <string_view>

#include <nlohmann/json_fwd.hpp>

namespace trundle {

/// Reads run.json, info.json, odometry.json, slip.json, slam.json or evaluation.json, `name` telling which,
/// and checks what the report uses of it. Throws InputError with file, what stands there and what was
/// expected.
nlohmann::ordered_json parse_result_document(std::string_view text, std::string_view name,
                                             std::string_view file_name);

}  // namespace trundle
