#include "trundle/report/json_text.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "trundle/io/error.hpp"

namespace trundle::report {
namespace {

using Json = nlohmann::ordered_json;

bool on_one_line(const Json& value) {
  return value.empty() || !value.is_structured() ||
         (value.is_array() && std::ranges::none_of(value, [](const Json& v) { return v.is_structured(); }));
}

/// The last look: JSON would write null, which is what is not known, and says so (or_null.hpp).
void require_finite(const Json& value, std::string_view key) {
  if (value.is_number_float() && !std::isfinite(value.get<double>()))
    throw CannotAnswer(fmt::format(
        "{} would be {}, which is no number; a reading, a noise or a start is out of all proportion", key,
        value.get<double>()));
  if (value.is_structured())
    for (const auto& item : value.items())
      require_finite(item.value(), value.is_object() ? std::string_view(item.key()) : key);
}

void append(const Json& value, const std::string& indent, std::string& text) {
  if (on_one_line(value)) {
    text += value.dump(-1, ' ', false, Json::error_handler_t::replace);
    return;
  }
  const std::string inner = indent + "  ";
  const char* separator = "\n";
  text += value.is_object() ? '{' : '[';
  for (const auto& item : value.items()) {
    text += separator + inner;
    if (value.is_object()) text += dumped(item.key()) + ": ";
    append(item.value(), inner, text);
    separator = ",\n";
  }
  text += '\n' + indent + (value.is_object() ? '}' : ']');
}

}  // namespace

std::string json_text(const Json& document) {
  require_finite(document, "a value");
  std::string text;
  append(document, "", text);
  return text + '\n';
}

std::string dumped(const Json& document, int indent) {
  require_finite(document, "a value");
  return document.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace trundle::report
