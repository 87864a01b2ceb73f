#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>

#include "trundle/logs/layout.hpp"

namespace trundle::logs {

/// Schemas of WPILib's structures by their names: "Translation2d translation;Rotation2d rotation".
using WpilibSchemas = std::map<std::string, std::string, std::less<>>;

/// Of a structure, or of as many as the message holds (then the field `value`), packed as WPILib's struct
/// serialization 1.0 says. Throws BadDefinition where a schema is missing or is none, or one contains itself.
[[nodiscard]] Layout layout_of_wpilib_struct(std::string_view name, bool is_array,
                                             const WpilibSchemas& schemas);

}  // namespace trundle::logs
