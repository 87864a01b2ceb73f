#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "trundle/logs/survey.hpp"
#include "trundle/namespaces.hpp"

namespace trundle::pipeline {

/// The words of a name, in small letters: of "FrontLeft/DrivePositionRad[2]" front, left, drive, position,
/// rad, 2.
[[nodiscard]] std::vector<std::string> words_of(std::string_view name);
/// "mm", "cm", "in" or "ft" where a word says so; empty: none does.
[[nodiscard]] std::string length_unit_in(const std::vector<std::string>& words);
/// Of a topic and a field of it; the field of a topic that is a single value has no name of its own.
[[nodiscard]] std::vector<std::string> words_of(const logs::TopicSummary& topic,
                                                const logs::FieldSummary& field);
[[nodiscard]] bool has_word(const std::vector<std::string>& words,
                            std::initializer_list<std::string_view> any);

/// Which of several wheels a name means.
struct WheelPlace {
  int row = 0;                    ///< 1: front, -1: rear, 0: neither is said
  int side = 0;                   ///< 1: left, -1: right
  std::optional<int> index = {};  ///< of wheels that are numbered instead

  bool operator==(const WheelPlace&) const = default;
};
struct PlacedName {
  WheelPlace place;
  std::string pattern;  ///< the words, with stars for those that say the place
};
/// Nothing: the name means no wheel in particular.
[[nodiscard]] std::optional<PlacedName> placed(const std::vector<std::string>& words);
/// "front_left", "left", "wheel_2".
[[nodiscard]] std::string wheel_name(const WheelPlace& place);

}  // namespace trundle::pipeline
