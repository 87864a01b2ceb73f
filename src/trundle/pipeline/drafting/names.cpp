#include "trundle/pipeline/drafting/detail/names.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <numeric>

#include <fmt/format.h>

namespace trundle::pipeline {
namespace {

enum class Letter { small, capital, digit, other };

Letter letter_of(char c) {
  if (c >= 'a' && c <= 'z') return Letter::small;
  if (c >= 'A' && c <= 'Z') return Letter::capital;
  if (c >= '0' && c <= '9') return Letter::digit;
  return Letter::other;
}

struct PlaceWord {
  std::string_view word;
  int row;
  int side;
};
/// Two letters mean row and side, in either order; 'b' and 'r' alone are left to whoever knows.
constexpr std::array kPlaceWords = {
    PlaceWord{"left", 0, 1},        PlaceWord{"right", 0, -1},      PlaceWord{"l", 0, 1},
    PlaceWord{"r", 0, -1},          PlaceWord{"lft", 0, 1},         PlaceWord{"rgt", 0, -1},
    PlaceWord{"front", 1, 0},       PlaceWord{"rear", -1, 0},       PlaceWord{"back", -1, 0},
    PlaceWord{"fl", 1, 1},          PlaceWord{"fr", 1, -1},         PlaceWord{"rl", -1, 1},
    PlaceWord{"rr", -1, -1},        PlaceWord{"bl", -1, 1},         PlaceWord{"br", -1, -1},
    PlaceWord{"lf", 1, 1},          PlaceWord{"rf", 1, -1},         PlaceWord{"lr", -1, 1},
    PlaceWord{"lb", -1, 1},         PlaceWord{"rb", -1, -1},        PlaceWord{"frontleft", 1, 1},
    PlaceWord{"frontright", 1, -1}, PlaceWord{"rearleft", -1, 1},   PlaceWord{"rearright", -1, -1},
    PlaceWord{"backleft", -1, 1},   PlaceWord{"backright", -1, -1}, PlaceWord{"leftfront", 1, 1},
    PlaceWord{"rightfront", 1, -1}, PlaceWord{"leftrear", -1, 1},   PlaceWord{"rightrear", -1, -1}};

/// What a number behind tells apart.
constexpr std::array<std::string_view, 10> kCounted = {"value",   "mod",  "module", "swerve", "wheel",
                                                       "encoder", "dist", "motor",  "speed",  "wheels"};

bool is_number(std::string_view word) {
  return !word.empty() && word.size() < 3 &&
         std::ranges::all_of(word, [](char c) { return letter_of(c) == Letter::digit; });
}

}  // namespace

std::vector<std::string> words_of(std::string_view name) {
  std::vector<std::string> words;
  Letter before = Letter::other;
  for (std::size_t i = 0; i < name.size(); ++i) {
    const Letter letter = letter_of(name[i]);
    // "YawRate": a capital begins a word; "RPM", "DPSValue": the last of several does where a small one
    // follows.
    const bool ends_capitals = letter == Letter::capital && before == Letter::capital &&
                               i + 1 < name.size() && letter_of(name[i + 1]) == Letter::small;
    const bool begins =
        letter != Letter::other &&
        (before == Letter::other || (letter == Letter::capital && before != Letter::capital) ||
         ends_capitals || (letter == Letter::digit) != (before == Letter::digit));
    if (begins) words.emplace_back();
    if (letter != Letter::other)
      words.back() += static_cast<char>(std::tolower(static_cast<unsigned char>(name[i])));
    before = letter;
  }
  return words;
}

std::vector<std::string> words_of(const logs::TopicSummary& topic, const logs::FieldSummary& field) {
  return words_of(topic.topic + "/" + (field.path == "value" ? "" : field.path));
}

bool has_word(const std::vector<std::string>& words, std::initializer_list<std::string_view> any) {
  return std::ranges::any_of(
      words, [&](const std::string& word) { return std::ranges::find(any, word) != any.end(); });
}

std::string length_unit_in(const std::vector<std::string>& words) {
  if (has_word(words, {"mm", "millimeters", "millimetres"})) return "mm";
  if (has_word(words, {"cm", "centimeters", "centimetres"})) return "cm";
  if (has_word(words, {"inch", "inches", "in"})) return "in";
  if (has_word(words, {"ft", "feet", "foot"})) return "ft";
  return {};
}

std::optional<PlacedName> placed(const std::vector<std::string>& words) {
  PlacedName name;
  const auto add = [&](std::string_view word) { (name.pattern += name.pattern.empty() ? "" : " ") += word; };
  for (std::size_t i = 0; i < words.size(); ++i) {
    const auto known = std::ranges::find(kPlaceWords, words[i], &PlaceWord::word);
    if (known != kPlaceWords.end()) {
      if (known->row != 0) name.place.row = known->row;
      if (known->side != 0) name.place.side = known->side;
      add("*");
    } else if (i > 0 && is_number(words[i]) && std::ranges::find(kCounted, words[i - 1]) != kCounted.end()) {
      name.place.index = std::stoi(words[i]);
      add("*");
    } else {
      add(words[i]);
    }
  }
  if (name.place.side != 0) name.place.index.reset();  // "left wheel 1"
  if (name.place.side == 0 && !name.place.index) return std::nullopt;
  return name;
}

std::string wheel_name(const WheelPlace& place) {
  if (place.side == 0) return fmt::format("wheel_{}", place.index.value_or(0));
  const char* const row = place.row > 0 ? "front_" : place.row < 0 ? "rear_" : "";
  return std::string(row) + (place.side > 0 ? "left" : "right");
}

}  // namespace trundle::pipeline
