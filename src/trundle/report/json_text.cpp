#include "trundle/report/json_text.hpp"

#include <algorithm>

#include <nlohmann/json.hpp>

namespace trundle {
namespace {

using Json = nlohmann::ordered_json;

std::string plain_text(const Json& value) {
  return value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

bool on_one_line(const Json& value) {
  return value.empty() || !value.is_structured() ||
         (value.is_array() && std::ranges::none_of(value, [](const Json& v) { return v.is_structured(); }));
}

void append(const Json& value, const std::string& indent, std::string& text) {
  if (on_one_line(value)) {
    text += plain_text(value);
    return;
  }
  const std::string inner = indent + "  ";
  const char* separator = "\n";
  text += value.is_object() ? '{' : '[';
  for (const auto& item : value.items()) {
    text += separator + inner;
    if (value.is_object()) text += plain_text(item.key()) + ": ";
    append(item.value(), inner, text);
    separator = ",\n";
  }
  text += '\n' + indent + (value.is_object() ? '}' : ']');
}

}  // namespace

std::string json_text(const Json& document) {
  std::string text;
  append(document, "", text);
  return text + '\n';
}

}  // namespace trundle
