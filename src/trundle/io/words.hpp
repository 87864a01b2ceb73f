#pragma once

#include <string>
#include <string_view>

#include "trundle/namespaces.hpp"

namespace trundle::io {

/// "1 row", "2 rows".
std::string counted(std::size_t number, std::string_view noun);

/// So many decimals, and no minus before a zero.
std::string fixed(double value, int decimals);

/// A factor to three digits, a large one to whole ones: "0.0254", "1000".
std::string three_digits(double factor);

/// The value to the second digit of its sigma, both with the same decimals: "0.083822 ± 0.000050".
std::string with_sigma(double value, double sigma);

/// A sigma by itself: two digits, without exponent.
std::string sigma_text(double sigma);

/// What quotes files and their names, for one line or a screen: control characters, which may command a
/// terminal, become \x1B and the like. A screen keeps its line ends.
std::string one_line(std::string_view text);
std::string printable(std::string_view text);

/// What should stand where a TOML file has the fault that its parser names.
std::string expected_toml(std::string_view fault);

}  // namespace trundle::io
