#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <toml++/toml.h>

#include "trundle/chassis/detail/robot_keys.hpp"
#include "trundle/io/error.hpp"

// Values of a robot file with the places where they stand.
namespace trundle::chassis::robot_file {

/// The file as it was read: messages need its name, angles all their digits.
struct Source {
  std::string_view text;
  std::string_view name;
};

/// A table, and what messages call it.
struct Section {
  const Source& source;
  const toml::table& table;
  std::string title;  ///< "[gyro]"; empty: the top level
};

[[noreturn]] void fail(const Source& source, const toml::source_region& where, std::string_view fact,
                       std::string_view expectation);

/// Every key of the section must be one of `known`.
void check_keys(const Section& section, std::span<const std::string> known);

/// Value of a key that must be there.
const toml::node& required(const Section& section, std::string_view key, std::string_view expectation);

/// The number that stands at `node`: finite unless `infinite_too`, within range, radians where the key says
/// _deg.
double number(const Source& source, std::string_view key, const toml::node& node, const Range& range,
              bool infinite_too = false);
inline constexpr std::string_view kTruthExpected = "true or false";
/// true or false; `otherwise` where the key is missing.
bool truth_value(const Section& section, std::string_view key, bool otherwise);
std::string text(const Section& section, std::string_view key, std::string_view expectation);
/// The tables of an array of tables, [[key]]; none when it is missing.
std::vector<Section> tables(const Section& section, std::string_view key, std::string_view title);
/// The table [key], if it is there.
std::optional<Section> table(const Section& section, std::string_view key, std::string_view title);
std::vector<std::string> texts(const Section& section, std::string_view key);

/// "[gyro]: " + fact, or the fact alone at the top level.
std::string in(const Section& section, std::string_view fact);

template <class T, std::size_t n>
void read_numbers(const Section& section, const std::array<NumberKey<T>, n>& keys, T& target) {
  for (const NumberKey<T>& key : keys) {
    const toml::node* node = section.table.get(key.name);
    if (node == nullptr && key.presence == Presence::required)
      node = &required(section, key.name, key.range.words);
    if (node != nullptr) key.in(target) = number(section.source, key.name, *node, key.range);
  }
}

}  // namespace trundle::chassis::robot_file
