#pragma once

#include <optional>

#include <nlohmann/json.hpp>

#include "trundle/namespaces.hpp"

namespace trundle::report {

/// What is not known is null.
template <class T>
[[nodiscard]] nlohmann::ordered_json or_null(const std::optional<T>& value) {
  return value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json(nullptr);
}

/// The same of what `make` makes of it.
template <class T, class Make>
[[nodiscard]] nlohmann::ordered_json or_null(const std::optional<T>& value, Make make) {
  return value ? make(*value) : nlohmann::ordered_json(nullptr);
}

}  // namespace trundle::report
