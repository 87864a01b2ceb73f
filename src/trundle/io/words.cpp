#include "trundle/io/words.hpp"

#include <fmt/format.h>

namespace trundle {

std::string counted(std::size_t number, std::string_view noun) {
  return fmt::format("{} {}{}", number, noun, number == 1 ? "" : "s");
}

std::string expected_toml(std::string_view fault) {
  const auto says = [&](std::string_view words) { return fault.find(words) != fault.npos; };
  if (says("cannot redefine existing table"))
    return "each table once; of several, each under a line with two brackets, like [[wheel]]";
  if (says("cannot redefine existing")) return "each key once";
  if (says("not representable") || says("could not be interpreted")) return "a number that is in range";
  if (says("value type") || says("floating-point") || says("integer") || says("boolean"))
    return "a number, true, false, or text in quotes";
  return "TOML";
}

}  // namespace trundle
