#pragma once

#include <span>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "trundle/namespaces.hpp"

namespace trundle::report {

/// A column of numbers to draw: {"offset", "float32"}. float32 is base64 (RFC 4648) of 32-bit little-endian
/// IEEE floats; a value is offset + float, NaN where there is none. The offset, the first finite value, keeps
/// the digits of stamps and positions far from zero.
nlohmann::ordered_json column_json(std::span<const double> values);

/// Some of the values, in the order of `rows`.
nlohmann::ordered_json column_json(std::span<const double> values, std::span<const std::size_t> rows);

}  // namespace trundle::report
