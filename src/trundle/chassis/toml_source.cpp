#include "trundle/chassis/detail/toml_source.hpp"

#include <algorithm>
#include <cmath>

namespace trundle::chassis::robot_file {
namespace {

/// Bytes of the line, without its end.
std::string_view line_of(std::string_view text, std::size_t line) {
  for (std::size_t i = 1; i < line; ++i) text.remove_prefix(std::min(text.size(), text.find('\n') + 1));
  return text.substr(0, text.find('\n'));
}

/// toml++ counts columns in code points: skips that many.
std::string_view after_code_points(std::string_view line, std::size_t count) {
  const auto starts_code_point = [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; };
  std::size_t byte = 0;
  for (; byte < line.size(); ++byte)
    if (starts_code_point(line[byte]) && count-- == 0) break;
  return line.substr(byte);
}

/// What was written for a number, without the underscores that TOML allows.
std::string digits_of(const Source& source, const toml::source_region& where) {
  const auto first_column = where.begin.column;
  std::string digits(after_code_points(line_of(source.text, where.begin.line), first_column - 1)
                         .substr(0, where.end.column - first_column));
  std::erase(digits, '_');
  return digits;
}

/// As it stands in the file, for messages.
std::string shown(const toml::node& node) {
  if (const auto* value = node.as_string()) return fmt::format("\"{}\"", value->get());
  if (const auto* value = node.as_integer()) return fmt::format("{}", value->get());
  if (const auto* value = node.as_floating_point()) return fmt::format("{}", value->get());
  if (const auto* value = node.as_boolean()) return value->get() ? "true" : "false";
  if (node.is_array()) return "an array";
  return node.is_table() ? "a table" : "a date or time";
}

[[noreturn]] void fail_type(const Source& source, std::string_view key, const toml::node& node,
                            std::string_view expectation) {
  fail(source, node.source(), fmt::format("{} is {}", key, shown(node)), expectation);
}

}  // namespace

void fail(const Source& source, const toml::source_region& where, std::string_view fact,
          std::string_view expectation) {
  throw InputError(place(source.name, where.begin.line), fact, expectation);
}

std::string in(const Section& section, std::string_view fact) {
  return section.title.empty() ? std::string(fact) : fmt::format("{}: {}", section.title, fact);
}

void check_keys(const Section& section, std::span<const std::string> known) {
  for (const auto& [key, node] : section.table) {
    if (std::ranges::find(known, key.str()) != known.end()) continue;
    const std::string meant = nearest_name(key.str(), known);
    fail(section.source, key.source(), in(section, fmt::format("unknown key '{}'", key.str())),
         meant.empty() ? fmt::format("one of {}", fmt::join(known, ", ")) : fmt::format("'{}'", meant));
  }
}

const toml::node& required(const Section& section, std::string_view key, std::string_view expectation) {
  const toml::node* node = section.table.get(key);
  if (node == nullptr)
    fail(section.source, section.table.source(), in(section, fmt::format("no key '{}'", key)), expectation);
  return *node;
}

double number(const Source& source, std::string_view key, const toml::node& node, const Range& range,
              bool infinite_too) {
  if (!node.is_number()) fail_type(source, key, node, range.words);
  double value = *node.value<double>();
  if (is_degrees(key)) {
    const double exact = radians_of_text(digits_of(source, node.source()));
    value = std::isfinite(exact) ? exact : radians(value);
  }
  const bool bounded = std::isfinite(value) || (infinite_too && !std::isnan(value));
  if (!bounded || !range.holds(value)) fail_type(source, key, node, range.words);
  return value;
}

bool truth_value(const Section& section, std::string_view key, bool otherwise) {
  const toml::node* node = section.table.get(key);
  if (node == nullptr) return otherwise;
  if (!node->is_boolean()) fail_type(section.source, key, *node, kTruthExpected);
  return node->as_boolean()->get();
}

std::string text(const Section& section, std::string_view key, std::string_view expectation) {
  const toml::node& node = required(section, key, expectation);
  if (!node.is_string()) fail_type(section.source, key, node, expectation);
  return node.as_string()->get();
}

std::vector<Section> tables(const Section& section, std::string_view key, std::string_view title) {
  const toml::node* node = section.table.get(key);
  if (node == nullptr) return {};
  const toml::array* array = node->as_array();
  if (array == nullptr || !(array->empty() || array->is_homogeneous(toml::node_type::table)))
    fail_type(section.source, key, *node, fmt::format("tables, each under a line {}", title));
  std::vector<Section> sections;
  for (const toml::node& element : *array)
    sections.push_back({section.source, *element.as_table(), std::string(title)});
  return sections;
}

std::optional<Section> table(const Section& section, std::string_view key, std::string_view title) {
  const toml::node* node = section.table.get(key);
  if (node == nullptr) return std::nullopt;
  if (!node->is_table()) fail_type(section.source, key, *node, fmt::format("a table under a line {}", title));
  return Section{section.source, *node->as_table(), std::string(title)};
}

std::vector<std::string> texts(const Section& section, std::string_view key) {
  const toml::node* node = section.table.get(key);
  if (node == nullptr) return {};
  constexpr std::string_view kExpectation = "an array of strings";
  if (!node->is_array()) fail_type(section.source, key, *node, kExpectation);
  std::vector<std::string> result;
  for (const toml::node& element : *node->as_array()) {
    if (!element.is_string()) fail_type(section.source, key, element, kExpectation);
    result.push_back(element.as_string()->get());
  }
  return result;
}

}  // namespace trundle::chassis::robot_file
