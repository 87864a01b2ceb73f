#include "trundle/io/words.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

namespace trundle::io {
namespace {

/// That show two digits; nothing where there is no such number of them.
std::optional<int> decimals_of(double sigma) {
  constexpr double kMost = 12.0;  // of a value of order 1e3 a double knows no more
  if (!(sigma > 0.0) || !std::isfinite(sigma)) return std::nullopt;
  return static_cast<int>(std::clamp(1.0 - std::floor(std::log10(sigma)), 0.0, kMost));
}

bool is_control(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return byte < 0x20U || byte == 0x7FU;
}

std::string without_controls(std::string_view text, std::string_view kept) {
  std::string result;
  for (const char c : text) {
    if (is_control(c) && kept.find(c) == kept.npos) {
      result += fmt::format("\\x{:02X}", static_cast<unsigned char>(c));
    } else {
      result += c;
    }
  }
  return result;
}

}  // namespace

std::string counted(std::size_t number, std::string_view noun) {
  return fmt::format("{} {}{}", number, noun, number == 1 ? "" : "s");
}

std::string fixed(double value, int decimals) {
  std::string text = fmt::format("{:.{}f}", value, decimals);
  const bool zero = text.find_first_of("123456789") == text.npos && std::isfinite(value);
  return zero && text.front() == '-' ? text.substr(1) : text;
}

std::string three_digits(double factor) {
  return factor < 999.5 ? fmt::format("{:.3g}", factor) : fmt::format("{:.0f}", factor);
}

std::string with_sigma(double value, double sigma) {
  const auto decimals = decimals_of(sigma);
  return fmt::format("{} ± {}", decimals ? fixed(value, *decimals) : fmt::format("{:.6g}", value),
                     sigma_text(sigma));
}

std::string sigma_text(double sigma) {
  const auto decimals = decimals_of(sigma);
  return decimals ? fixed(sigma, *decimals) : fmt::format("{:.2g}", sigma);
}

std::string one_line(std::string_view text) {
  return without_controls(text, "");
}

std::string printable(std::string_view text) {
  return without_controls(text, "\n");
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

}  // namespace trundle::io
