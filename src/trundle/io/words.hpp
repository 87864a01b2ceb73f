#pragma once

#include <string>
#include <string_view>

namespace trundle {

/// "1 row", "2 rows".
std::string counted(std::size_t number, std::string_view noun);

/// What should stand where a TOML file has the fault that its parser names.
std::string expected_toml(std::string_view fault);

}  // namespace trundle
