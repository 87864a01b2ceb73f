#include "trundle/report/json_rules.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "trundle/io/error.hpp"

namespace trundle::report {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::array<std::pair<JsonType, std::string_view>, 6> kTypeNames = {{{kString, "a string"},
                                                                              {kNumber, "a number"},
                                                                              {kBool, "true or false"},
                                                                              {kArray, "an array"},
                                                                              {kObject, "an object"},
                                                                              {kNull, "null"}}};

JsonType type_of(const Json& value) {
  if (value.is_string()) return kString;
  if (value.is_number()) return kNumber;
  if (value.is_boolean()) return kBool;
  if (value.is_array()) return kArray;
  return value.is_object() ? kObject : kNull;
}

std::string in_words(unsigned types) {
  std::string text;
  for (const auto& [type, name] : kTypeNames)
    if ((types & type) != 0) text += (text.empty() ? "" : " or ") + std::string(name);
  return text;
}

/// Follows one rule into a document and throws where a value is missing or of another type.
class RuleCheck {
 public:
  RuleCheck(std::string_view file_name, unsigned types) : file_name_(file_name), types_(types) {}

  void follow(const Json& value, std::string_view rest, const std::string& where) const {
    if (rest.empty()) return expect_type(value, where);
    if (value.is_null()) return;
    const std::string_view key = rest.substr(0, rest.find('/'));
    const std::string_view next =
        key.size() == rest.size() ? std::string_view() : rest.substr(key.size() + 1);
    if (key != "*") return follow_key(value, std::string(key), next, where);
    for (std::size_t i = 0; i < value.size(); ++i) follow(value[i], next, fmt::format("{}[{}]", where, i));
  }

 private:
  void follow_key(const Json& value, const std::string& key, std::string_view next,
                  const std::string& where) const {
    const std::string path = where.empty() ? key : where + "." + key;
    const auto found = value.find(key);
    if (found == value.end() && (types_ & kMissing) != 0) return;
    if (found == value.end())
      throw InputError(file_name_, fmt::format("\"{}\" is missing", path), in_words(types_));
    follow(*found, next, path);
  }

  void expect_type(const Json& value, const std::string& where) const {
    const JsonType type = type_of(value);
    if ((types_ & type) == 0)
      throw InputError(file_name_, fmt::format("\"{}\" is {}", where, in_words(type)), in_words(types_));
  }

  std::string_view file_name_;
  unsigned types_;
};

constexpr int kDeepest = 100;              // brackets within brackets; ours have ten
constexpr std::size_t kMostKeys = 10'000;  // of an object: each is compared with all before it

}  // namespace

Json parse_json(std::string_view text, std::string_view file_name, std::string_view expected) {
  std::array<std::size_t, kDeepest + 2> keys{};  // of the object at each depth
  const auto is_plausible = [&](int depth, Json::parse_event_t event, const Json&) {
    if (depth > kDeepest) throw InputError(file_name, "nests deeper than any result", expected);
    const auto here = static_cast<std::size_t>(depth);
    if (event == Json::parse_event_t::object_start) keys[here + 1] = 0;
    if (event == Json::parse_event_t::key && ++keys[here] > kMostKeys)
      throw InputError(file_name, "holds an object of more keys than any result", expected);
    return true;
  };
  try {
    return Json::parse(text, is_plausible);
  } catch (const Json::out_of_range&) {
    throw InputError(file_name, "holds a number that is out of range", expected);
  } catch (const Json::parse_error& error) {
    const std::size_t end = std::min(error.byte, text.size());
    const std::size_t line = 1 + static_cast<std::size_t>(std::count(
                                     text.begin(), text.begin() + static_cast<std::ptrdiff_t>(end), '\n'));
    throw InputError(place(file_name, line), "is not JSON here", expected);
  }
}

Json parse_result(std::string_view text, std::string_view name, std::span<const JsonRule> rules,
                  std::string_view file_name) {
  Json document = parse_json(text, file_name, fmt::format("{}.json as trundle writes it", name));
  if (!document.is_object()) throw InputError(file_name, "is JSON but not an object", "{...}");
  check_rules(document, rules, file_name);
  return document;
}

void check_rules(const Json& document, std::span<const JsonRule> rules, std::string_view file_name) {
  for (const JsonRule& rule : rules) RuleCheck(file_name, rule.types).follow(document, rule.path, "");
}

void expect_same_lengths(const Json& document, const char* name, std::span<const char* const> columns,
                         std::string_view file_name) {
  if (!document.contains(name)) return;
  const Json& table = document.at(name);
  for (const char* column : columns) {
    const std::size_t expected = table.value(columns.front(), Json::array()).size();
    const std::size_t found = table.value(column, Json::array()).size();
    if (!table.contains(column) || found != expected)
      throw InputError(file_name, fmt::format("\"{}.{}\" has {} entries", name, column, found),
                       fmt::format("{}, as \"{}\" has", expected, columns.front()));
  }
}

}  // namespace trundle::report
