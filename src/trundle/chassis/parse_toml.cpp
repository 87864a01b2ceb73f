#include "trundle/chassis/detail/parse_toml.hpp"

#include <algorithm>
#include <string>

#include "trundle/io/error.hpp"
#include "trundle/io/words.hpp"

namespace trundle::chassis {
namespace {

// The parser bounds the depth of values, not of dotted keys, and walks tables by recursion: a key of so many
// parts was made to break a stack.
constexpr int kMostParts = 1000;

/// Past the string that begins here: quoted once or three times, with escapes in double quotes.
std::size_t end_of_string(std::string_view text, std::size_t begin) {
  const char quote = text[begin];
  const std::string triple(3, quote);
  const bool is_long = text.substr(begin, 3) == triple;
  std::size_t at = begin + (is_long ? 3 : 1);
  while (at < text.size()) {
    if (text[at] == '\\' && quote == '"')
      ++at;
    else if (is_long ? text.substr(at, 3) == triple : text[at] == quote || text[at] == '\n')
      return at + (is_long ? 3 : 1);
    ++at;
  }
  return text.size();
}

void require_shallow_keys(std::string_view text, std::string_view file_name) {
  int parts = 1;
  for (std::size_t at = 0; at < text.size();) {
    const char c = text[at];
    if (c == '"' || c == '\'') {
      at = end_of_string(text, at);
      continue;
    }
    if (c == '#') {
      at = std::min(text.find('\n', at), text.size());
      continue;
    }
    if (std::string_view("=,{}[]\n").find(c) != std::string_view::npos) parts = 1;
    if (c == '.' && ++parts > kMostParts) {
      const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n');
      throw InputError(place(file_name, static_cast<std::size_t>(line)),
                       "a key of more than a thousand parts", "TOML");
    }
    ++at;
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
