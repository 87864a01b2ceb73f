#include "trundle/logs/detail/field_path.hpp"

#include <algorithm>
#include <charconv>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/logs/detail/wire.hpp"

namespace trundle::logs {
namespace {

std::string field_names(const LayoutStructure& structure) {
  constexpr std::size_t kMostNames = 12;  // more would make a list of the message
  std::string names;
  std::size_t shown = 0;
  for (const LayoutField& field : structure.fields) {
    if (field.is_padding) continue;
    if (++shown > kMostNames) return names + ", …";
    names += (names.empty() ? "" : ", ") + field.name;
  }
  return names.empty() ? "nothing: it has no fields" : names;
}

std::string nearest_field(const LayoutStructure& structure, std::string_view name) {
  std::vector<std::string> names;
  for (const LayoutField& field : structure.fields) names.push_back(field.name);
  const std::string nearest = nearest_name(name, names);
  return nearest.empty() ? "one of " + field_names(structure) : "'" + nearest + "'";
}

std::size_t field_named(const LayoutStructure& structure, std::string_view name) {
  for (std::size_t i = 0; i < structure.fields.size(); ++i)
    if (structure.fields[i].name == name && !structure.fields[i].is_padding) return i;
  throw UnknownField(fmt::format("{} has no field '{}'", structure.name, name),
                     nearest_field(structure, name));
}

/// Up to the first of a character that is in no brackets; the rest without it.
std::string_view split(std::string_view& text, char end) {
  std::size_t depth = 0;
  std::size_t at = 0;
  for (; at < text.size() && (text[at] != end || depth > 0); ++at) {
    if (text[at] == '[') ++depth;
    if (text[at] == ']' && depth > 0) --depth;
  }
  const std::string_view first = text.substr(0, at);
  text = text.substr(std::min(at + 1, text.size()));
  return first;
}

class PathCompiler {
 public:
  explicit PathCompiler(const Layout& layout) : layout_(layout) {}

  std::vector<FieldStep> compile(const LayoutStructure& root, std::string_view path) const {
    std::vector<FieldStep> steps;
    const LayoutStructure* structure = &root;
    for (std::string_view rest = path; structure != nullptr;) {
      const std::string_view part = split(rest, '.');
      steps.push_back(step_of(*structure, part));
      const LayoutField& field = steps.back().target();
      const bool is_structure = field.type == FieldType::structure;
      structure = is_structure ? &layout_.structures()[field.structure] : nullptr;
      if (rest.empty()) break;
      if (!is_structure)
        throw UnknownField(fmt::format("'{}' of '{}' has no fields", part, path), "a path that ends there");
    }
    require_value(path, structure);
    return steps;
  }

 private:
  static void require_value(std::string_view path, const LayoutStructure* structure) {
    if (structure != nullptr && !structure->is_time)
      throw UnknownField(fmt::format("'{}' is a structure", path),
                         "one of its fields: " + field_names(*structure));
  }

  FieldStep step_of(const LayoutStructure& structure, std::string_view part) const {
    const std::size_t bracket = part.find('[');
    const bool has_element = bracket != part.npos && part.ends_with(']');
    const std::string_view name = part.substr(0, bracket);
    FieldStep step{.structure = &structure, .field = field_named(structure, name)};
    const LayoutField& field = step.target();
    const bool is_array = field.arity != FieldArity::one && !Wire::is_text_array(field);
    if (!has_element) {
      if (is_array)
        throw UnknownField(fmt::format("'{}' is an array", name),
                           fmt::format("an element: {0}[0], {0}[name=…] or each, {0}[]", name));
      return step;
    }
    if (!is_array) throw UnknownField(fmt::format("'{}' is no array", name), fmt::format("'{}'", name));
    select(step, part.substr(bracket + 1, part.size() - bracket - 2));
    return step;
  }

  void select(FieldStep& step, std::string_view what) const {
    if (what.empty()) {
      step.selector = ElementSelector::all;
      return;
    }
    const char* const end = what.data() + what.size();
    const auto [stopped, error] = std::from_chars(what.data(), end, step.index);
    if (error == std::errc() && stopped == end) {
      step.selector = ElementSelector::index;
      return;
    }
    if (step.target().type == FieldType::structure) return select_by_field(step, what);
    select_by_sibling(step, what);
  }

  void select_by_field(FieldStep& step, std::string_view what) const {
    step.selector = ElementSelector::by_field;
    const LayoutStructure& element = layout_.structures()[step.target().structure];
    while (!what.empty()) {
      std::string_view condition = split(what, ',');
      const std::string_view path = key_of(condition);
      step.conditions.push_back({compile(element, path), std::string(condition)});
    }
  }

  static void select_by_sibling(FieldStep& step, std::string_view what) {
    std::string_view key = key_of(what);
    if (key == "joint") key = "name";  // of sensor_msgs/JointState, where everybody says joint
    step.selector = ElementSelector::by_sibling;
    step.sibling = field_named(*step.structure, key);
    const LayoutField& names = step.structure->fields[step.sibling];
    if (names.type != FieldType::string || names.arity == FieldArity::one)
      throw UnknownField(fmt::format("'{}' is no array of texts", key),
                         "the array of names beside the numbers");
    step.conditions.push_back({{}, std::string(what)});
  }

  /// "name=left": the key, and `condition` becomes what it is to be.
  static std::string_view key_of(std::string_view& condition) {
    const std::size_t equals = condition.find('=');
    if (equals == condition.npos)
      throw UnknownField(fmt::format("'[{}]' selects no element", condition), "[3], [name=left_wheel] or []");
    const std::string_view key = condition.substr(0, equals);
    condition.remove_prefix(equals + 1);
    return key;
  }

  const Layout& layout_;
};

}  // namespace

std::vector<FieldStep> compile_path(const Layout& layout, std::string_view path) {
  return PathCompiler(layout).compile(layout.root(), path);
}

}  // namespace trundle::logs
