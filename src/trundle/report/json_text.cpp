#include "trundle/report/json_text.hpp"

#include <algorithm>

#include <nlohmann/json.hpp>

namespace trundle::report {
namespace {

using Json = nlohmann::ordered_json;

constexpr char kDelete = '\x7f';

bool on_one_line(const Json& value) {
  return value.empty() || !value.is_structured() ||
         (value.is_array() && std::ranges::none_of(value, [](const Json& v) { return v.is_structured(); }));
}

void append(const Json& value, const std::string& indent, std::string& text) {
  if (on_one_line(value)) {
    text += dumped(value);
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
  std::string text;
  append(document, "", text);
  return text + '\n';
}

std::string dumped(const Json& document, int indent) {
  const std::string text = document.dump(indent, ' ', false, Json::error_handler_t::replace);
  if (text.find(kDelete) == text.npos) return text;
  std::string escaped;  // it stands in texts alone, where the standard lets it be and a terminal does not
  for (const char c : text) escaped += c == kDelete ? "\\u007f" : std::string(1, c);
  return escaped;
}

}  // namespace trundle::report
