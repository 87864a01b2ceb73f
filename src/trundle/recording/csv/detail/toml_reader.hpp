#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <toml++/toml.h>

#include "trundle/namespaces.hpp"

namespace trundle::recording {

/// One table of a TOML file, read key by key. Errors name the file, the line and the table.
class TomlReader {
 public:
  /// `title` is what messages call the table, e.g. "[wheels]"; empty at the top level.
  TomlReader(const toml::table& table, std::string file, std::string title);

  bool has(std::string_view key) const { return table_->contains(key); }
  /// Each returns nothing when the key is missing and throws InputError when it is something else.
  std::optional<double> number(const std::string& key);
  std::optional<double> number_above_zero(const std::string& key);
  std::optional<std::int64_t> integer(const std::string& key);
  std::optional<std::string> text(const std::string& key);
  /// None where the key is missing.
  std::vector<std::string> texts(const std::string& key);
  std::optional<bool> boolean(const std::string& key);
  std::optional<TomlReader> table(const std::string& key);
  /// Keys in the order of their names, known ones or not.
  std::vector<std::string> keys() const;
  /// The value as it is; nullptr when the key is missing.
  const toml::node* node(const std::string& key);

  /// Throws InputError for the first key that nothing asked for, and names the nearest one that was.
  void check_keys() const;

  /// "file:line" of a key, or of the table when it has no such key.
  std::string place_of(const std::string& key = {}) const;
  [[noreturn]] void fail(const std::string& key, const std::string& fact,
                         const std::string& expectation) const;

 private:
  const toml::table* table_;
  std::string file_;
  std::string title_;
  std::set<std::string> asked_;
};

}  // namespace trundle::recording
