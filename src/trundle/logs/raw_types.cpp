#include "trundle/logs/detail/raw_types.hpp"

#include <algorithm>
#include <cctype>

#include <fmt/format.h>

namespace trundle::logs {
namespace {

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kSpaces = " \t\r";
  const std::size_t first = text.find_first_not_of(kSpaces);
  if (first == text.npos) return {};
  return text.substr(first, text.find_last_not_of(kSpaces) - first + 1);
}

/// Takes the first line off a text.
std::string_view take_line(std::string_view& text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return line;
}

bool is_rule(std::string_view line) {
  constexpr std::size_t kShortest = 3;  // ROS writes 80
  line = trimmed(line);
  return line.size() >= kShortest && line.find_first_not_of('=') == line.npos;
}

/// Structures in the order that Layout wants: those that a structure uses before it.
class Resolver {
 public:
  Resolver(RawTypes types, bool is_ros2) : types_(std::move(types)), is_ros2_(is_ros2) {}

  Layout resolve(const std::string& root) {
    add(root, "", 0);
    return Layout(std::move(structures_));
  }

 private:
  /// A type by its name, as it is used in a package.
  std::pair<std::string, const RawType*> find(const std::string& name, const std::string& package) {
    const bool is_full = name.find('/') != name.npos;
    const std::string full = is_full ? name : (name == "Header" ? "std_msgs/Header" : package + "/" + name);
    if (const auto found = types_.find(full); found != types_.end()) return {full, &found->second};
    if (const auto found = types_.find(name); found != types_.end()) return {name, &found->second};
    const std::string_view built_in = is_ros2_ ? built_in_definition(full) : std::string_view();
    if (built_in.empty()) throw BadDefinition(fmt::format("the type {} is not defined", full));
    return {full, &types_.emplace(full, parse_msg(built_in, true)).first->second};
  }

  std::uint32_t add(const std::string& name, const std::string& package, std::size_t depth) {
    const auto [full, type] = find(name, package);
    if (const auto found = indices_.find(full); found != indices_.end()) return found->second;
    if (depth >= Layout::kDeepest)
      throw BadDefinition(
          fmt::format("{} nests deeper than {} structures, or contains itself", full, Layout::kDeepest));
    LayoutStructure structure{.name = full, .fields = {}, .constants = type->constants};
    structure.extensibility = type->extensibility;
    const std::string inner_package = full.substr(0, full.find('/'));
    for (const RawField& raw : type->fields) {
      structure.fields.push_back(raw.field);
      if (!raw.structure.empty())
        structure.fields.back().structure = add(raw.structure, inner_package, depth + 1);
    }
    structure.is_time = is_ros2_ && is_time(structure);
    // C++ has no empty structures, and DDS writes the byte.
    if (is_ros2_ && structure.fields.empty())
      structure.fields.push_back({.name = "structure_needs_at_least_one_member", .is_padding = true});
    structures_.push_back(std::move(structure));
    const auto index = static_cast<std::uint32_t>(structures_.size() - 1);
    indices_.emplace(full, index);
    return index;
  }

  static bool is_time(const LayoutStructure& structure) {
    const auto is = [](const LayoutField& field, std::string_view name, FieldType type) {
      return field.name == name && field.type == type && field.arity == FieldArity::one;
    };
    return structure.fields.size() == 2 && is(structure.fields[0], "sec", FieldType::int32) &&
           is(structure.fields[1], "nanosec", FieldType::uint32);
  }

  RawTypes types_;
  bool is_ros2_;
  std::map<std::string, std::uint32_t, std::less<>> indices_;
  std::vector<LayoutStructure> structures_;
};

}  // namespace

std::string short_type_name(std::string_view type) {
  std::string name;
  for (std::size_t i = 0; i < type.size(); ++i) {
    const bool is_scope = type.substr(i).starts_with("::");
    name.push_back(is_scope ? '/' : type[i]);
    if (is_scope) ++i;
  }
  if (const std::size_t at = name.find("/msg/"); at != name.npos) name.erase(at, 4);
  return name;
}

Layout resolve(RawTypes types, std::string_view root, bool is_ros2) {
  return Resolver(std::move(types), is_ros2).resolve(short_type_name(root));
}

std::vector<DefinitionSection> sections_of(std::string_view type, std::string_view definition) {
  std::vector<DefinitionSection> sections;
  std::string name = short_type_name(type);
  const char* start = definition.data();
  const auto close = [&](const char* end) {
    sections.push_back({name, {start, static_cast<std::size_t>(end - start)}});
  };
  for (std::string_view rest = definition; !rest.empty();) {
    const char* const before = rest.data();
    if (!is_rule(take_line(rest))) continue;
    const char* const next = rest.data();
    const std::string_view head = trimmed(take_line(rest));
    const bool names_type = head.starts_with("MSG: ") || head.starts_with("IDL: ");
    // IDL in sections names the root, too, in a line of its own before which nothing stands.
    if (!trimmed({definition.data(), static_cast<std::size_t>(before - definition.data())}).empty() ||
        !sections.empty())
      close(before);
    if (names_type) name = short_type_name(trimmed(head.substr(5)));
    start = names_type ? rest.data() : next;
  }
  close(definition.data() + definition.size());
  return sections;
}

}  // namespace trundle::logs
