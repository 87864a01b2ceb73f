#include "trundle/chassis/detail/parse_toml.hpp"

#include <algorithm>

#include "trundle/io/error.hpp"
#include "trundle/io/words.hpp"

namespace trundle::chassis {
namespace {

// The parser bounds the depth of values, not of dotted keys, and walks tables by recursion. No line of ours
// has more points before its "=": a key of so many parts was made to break a stack.
constexpr std::ptrdiff_t kMostParts = 1000;

void require_shallow_keys(std::string_view text, std::string_view file_name) {
  std::size_t line = 1;
  for (std::size_t begin = 0; begin < text.size(); ++line) {
    const std::string_view whole = text.substr(begin, text.find('\n', begin) - begin);
    const std::string_view key = whole.substr(0, whole.find('='));
    if (std::ranges::count(key, '.') > kMostParts)
      throw InputError(place(file_name, line), "a key of more than a thousand parts", "TOML");
    begin += whole.size() + 1;
  }
}

}  // namespace

toml::table parse_toml(std::string_view text, std::string_view file_name) {
  require_shallow_keys(text, file_name);
  try {
    return toml::parse(text, file_name);
  } catch (const toml::parse_error& error) {
    throw InputError(place(file_name, error.source().begin.line), error.description(),
                     expected_toml(error.description()));
  }
}

}  // namespace trundle::chassis
