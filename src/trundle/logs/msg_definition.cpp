#include <array>
#include <charconv>
#include <optional>

#include <fmt/format.h>

#include "trundle/logs/detail/raw_types.hpp"

namespace trundle::logs {
namespace {

struct PlainType {
  std::string_view name;
  FieldType ros1;
  FieldType ros2;
};
constexpr std::array kPlainTypes = {
    PlainType{"bool", FieldType::boolean, FieldType::boolean},
    PlainType{"int8", FieldType::int8, FieldType::int8},
    PlainType{"uint8", FieldType::uint8, FieldType::uint8},
    PlainType{"int16", FieldType::int16, FieldType::int16},
    PlainType{"uint16", FieldType::uint16, FieldType::uint16},
    PlainType{"int32", FieldType::int32, FieldType::int32},
    PlainType{"uint32", FieldType::uint32, FieldType::uint32},
    PlainType{"int64", FieldType::int64, FieldType::int64},
    PlainType{"uint64", FieldType::uint64, FieldType::uint64},
    PlainType{"float32", FieldType::float32, FieldType::float32},
    PlainType{"float64", FieldType::float64, FieldType::float64},
    PlainType{"string", FieldType::string, FieldType::string},
    PlainType{"char", FieldType::uint8, FieldType::uint8},
    PlainType{"byte", FieldType::int8, FieldType::uint8},
    PlainType{"time", FieldType::time, FieldType::time},
    PlainType{"duration", FieldType::duration, FieldType::duration},
    PlainType{"wstring", FieldType::wide_string, FieldType::wide_string},
};

bool is_space(char c) {
  return c == ' ' || c == '\t' || c == '\r';
}

std::string_view take_spaces(std::string_view text) {
  while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
  return text;
}

/// Up to a space or one of `ends`.
std::string_view take_word(std::string_view& text, std::string_view ends = "") {
  text = take_spaces(text);
  std::size_t size = 0;
  while (size < text.size() && !is_space(text[size]) && ends.find(text[size]) == ends.npos) ++size;
  const std::string_view word = text.substr(0, size);
  text = take_spaces(text.substr(size));
  return word;
}

std::string_view without_comment(std::string_view text) {
  text = text.substr(0, text.find('#'));
  while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
  return text;
}

/// "float64[36]", "string<=10[<=5]": the field of such a type.
class TypeWord {
 public:
  TypeWord(std::string_view word, bool is_ros2) : word_(word), is_ros2_(is_ros2) {}

  RawField field() const {
    RawField raw;
    std::string_view base = word_;
    if (const std::size_t bracket = word_.find('['); bracket != word_.npos) {
      base = word_.substr(0, bracket);
      read_arity(word_.substr(bracket), raw.field);
    }
    base = base.substr(0, base.find("<="));
    if (base.empty()) fail();
    raw.field.type = FieldType::structure;
    for (const PlainType& plain : kPlainTypes)
      if (plain.name == base) raw.field.type = is_ros2_ ? plain.ros2 : plain.ros1;
    if (raw.field.type == FieldType::structure) raw.structure = short_type_name(base);
    return raw;
  }

 private:
  void read_arity(std::string_view brackets, LayoutField& field) const {
    if (brackets.size() < 2 || !brackets.ends_with(']')) fail();
    const std::string_view inside = brackets.substr(1, brackets.size() - 2);
    field.arity = FieldArity::dynamic;
    if (inside.empty() || inside.starts_with("<=")) return;
    field.arity = FieldArity::fixed;
    const char* const end = inside.data() + inside.size();
    const auto [stopped, error] = std::from_chars(inside.data(), end, field.count);
    if (error != std::errc() || stopped != end) fail();
  }

  [[noreturn]] void fail() const { throw BadDefinition(fmt::format("'{}' is no type", word_)); }

  std::string_view word_;
  bool is_ros2_;
};

void parse_msg_line(std::string_view line, bool is_ros2, RawType& type) {
  std::string_view rest = take_spaces(line);
  if (rest.empty() || rest.front() == '#') return;
  const std::string_view type_word = take_word(rest);
  const std::string_view name = take_word(rest, "=#");
  if (name.empty()) throw BadDefinition(fmt::format("'{}' is no field", without_comment(line)));
  RawField raw = TypeWord(type_word, is_ros2).field();
  raw.field.name = std::string(name);
  if (!rest.starts_with('=')) return type.fields.push_back(std::move(raw));
  // What follows "=" of a text is all of it; '#' too.
  const std::string_view value = take_spaces(rest.substr(1));
  const bool is_text = raw.field.type == FieldType::string || raw.field.type == FieldType::wide_string;
  type.constants.push_back({std::string(name), std::string(is_text ? value : without_comment(value))});
}

Layout parse_sections(std::string_view type, std::string_view definition, bool is_ros2) {
  RawTypes types;
  for (const DefinitionSection& section : sections_of(type, definition))
    types.try_emplace(section.type, parse_msg(section.text, is_ros2));
  return resolve(std::move(types), type, is_ros2);
}

}  // namespace

RawType parse_msg(std::string_view text, bool is_ros2) {
  RawType type;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    parse_msg_line(text.substr(0, end), is_ros2, type);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return type;
}

Layout parse_ros1msg(std::string_view type, std::string_view definition) {
  return parse_sections(type, definition, false);
}

Layout parse_ros2msg(std::string_view type, std::string_view definition) {
  return parse_sections(type, definition, true);
}

}  // namespace trundle::logs
