#pragma once

#include <string_view>

#include <toml++/toml.h>

#include "trundle/namespaces.hpp"

namespace trundle::chassis {

/// Throws InputError with file and line where the text is no TOML, or nests deeper than any file of ours.
[[nodiscard]] toml::table parse_toml(std::string_view text, std::string_view file_name);

}  // namespace trundle::chassis
