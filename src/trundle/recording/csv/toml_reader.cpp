#include "trundle/recording/csv/detail/toml_reader.hpp"

#include <cmath>

#include <fmt/format.h>

#include "trundle/io/error.hpp"

namespace trundle::recording {

TomlReader::TomlReader(const toml::table& table, std::string file, std::string title)
    : table_(&table), file_(std::move(file)), title_(std::move(title)) {}

const toml::node* TomlReader::node(const std::string& key) {
  asked_.insert(key);
  return table_->get(key);
}

std::string TomlReader::place_of(const std::string& key) const {
  const toml::node* const found = key.empty() ? nullptr : table_->get(key);
  return place(file_, (found != nullptr ? found->source() : table_->source()).begin.line);
}

void TomlReader::fail(const std::string& key, const std::string& fact, const std::string& expectation) const {
  throw InputError(place_of(key), title_.empty() ? fact : title_ + ": " + fact, expectation);
}

std::optional<double> TomlReader::number(const std::string& key) {
  const toml::node* const found = node(key);
  if (found == nullptr) return std::nullopt;
  const std::optional<double> value = found->value<double>();
  if (!found->is_number() || !value || !std::isfinite(*value))
    fail(key, fmt::format("{} is not a number", key), "a finite number");
  return value;
}

std::optional<double> TomlReader::number_above_zero(const std::string& key) {
  const std::optional<double> value = number(key);
  if (value && *value <= 0.0) fail(key, fmt::format("{} is {}", key, *value), "a number above 0");
  return value;
}

std::optional<std::int64_t> TomlReader::integer(const std::string& key) {
  const toml::node* const found = node(key);
  if (found == nullptr) return std::nullopt;
  if (!found->is_integer()) fail(key, fmt::format("{} is not a whole number", key), "a whole number");
  return found->value<std::int64_t>();
}

std::optional<std::string> TomlReader::text(const std::string& key) {
  const toml::node* const found = node(key);
  if (found == nullptr) return std::nullopt;
  if (!found->is_string()) fail(key, fmt::format("{} is not a text", key), "a text in quotes");
  return found->value<std::string>();
}

std::vector<std::string> TomlReader::texts(const std::string& key) {
  const toml::node* const found = node(key);
  if (found == nullptr) return {};
  const toml::array* const list = found->as_array();
  if (list == nullptr || !(list->empty() || list->is_homogeneous(toml::node_type::string)))
    fail(key, fmt::format("{} is no list of texts", key), "a list of texts in quotes, [\"a\", \"b\"]");
  std::vector<std::string> all;
  for (const toml::node& entry : *list) all.push_back(*entry.value<std::string>());
  return all;
}

std::optional<bool> TomlReader::boolean(const std::string& key) {
  const toml::node* const found = node(key);
  if (found == nullptr) return std::nullopt;
  if (!found->is_boolean()) fail(key, fmt::format("{} is neither true nor false", key), "true or false");
  return found->value<bool>();
}

std::optional<TomlReader> TomlReader::table(const std::string& key) {
  const toml::node* const found = node(key);
  if (found == nullptr) return std::nullopt;
  if (!found->is_table()) fail(key, fmt::format("{} is not a table", key), fmt::format("a table [{}]", key));
  const std::string inner = title_.empty() ? key : title_.substr(1, title_.size() - 2) + "." + key;
  return TomlReader(*found->as_table(), file_, "[" + inner + "]");
}

std::vector<std::string> TomlReader::keys() const {
  std::vector<std::string> names;
  for (const auto& [key, value] : *table_) names.emplace_back(key.str());
  return names;
}

void TomlReader::check_keys() const {
  const std::vector<std::string> known(asked_.begin(), asked_.end());
  for (const std::string& key : keys()) {
    if (asked_.contains(key)) continue;
    const std::string nearest = nearest_name(key, known);
    fail(key, fmt::format("unknown key '{}'", key),
         nearest.empty() ? fmt::format("one of {}", fmt::join(known, ", ")) : "'" + nearest + "'");
  }
}

}  // namespace trundle::recording
