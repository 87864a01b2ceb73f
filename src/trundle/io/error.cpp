#include "trundle/io/error.hpp"

#include <algorithm>
#include <numeric>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "trundle/io/words.hpp"

namespace trundle::io {
namespace {

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = std::exchange(row[j], std::min({row[j] + 1, row[j - 1] + 1, substituted}));
    }
  }
  return row.back();
}

/// Is `part` left over when some letters of `whole` are struck out?
bool is_abridged(std::string_view part, std::string_view whole) {
  for (const char c : whole)
    if (!part.empty() && part.front() == c) part.remove_prefix(1);
  return part.empty();
}

/// Near enough to be meant: few letters differ, or one is the other with words left out.
bool is_near(std::string_view a, std::string_view b, std::size_t distance) {
  if (a.size() > b.size()) std::swap(a, b);
  return distance <= std::max<std::size_t>(2, b.size() / 3) ||
         (5 * a.size() >= 2 * b.size() && is_abridged(a, b));
}

}  // namespace

InputError::InputError(std::string_view place, std::string_view fact, std::string_view expectation)
    : std::runtime_error(one_line(fmt::format("{}: {}; expected {}", place, fact, expectation))) {}

std::string place(std::string_view file, std::size_t line) {
  return fmt::format("{}:{}", file, line);
}

ExitCode exit_code_of(const std::exception& error) {
  if (dynamic_cast<const InputError*>(&error) != nullptr) return kBadInput;
  if (dynamic_cast<const CannotAnswer*>(&error) != nullptr) return kCannotAnswer;
  if (dynamic_cast<const std::system_error*>(&error) != nullptr) return kBadInput;
  return kBug;
}

std::string nearest_name(std::string_view name, std::span<const std::string> candidates) {
  // Letters: no name of ours is longer, and the time of a comparison grows with the square.
  constexpr std::size_t kLongestCompared = 64;
  if (name.size() > kLongestCompared) return {};
  std::string best;
  std::size_t best_distance = kLongestCompared;
  for (const std::string& candidate : candidates) {
    const std::size_t distance = edit_distance(name, candidate);
    if (distance < best_distance && is_near(name, candidate, distance)) {
      best_distance = distance;
      best = candidate;
    }
  }
  return best;
}

}  // namespace trundle::io
