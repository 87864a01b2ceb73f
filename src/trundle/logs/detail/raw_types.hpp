#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "trundle/logs/definitions.hpp"

namespace trundle::logs {

/// A field as a definition writes it: its structure by name.
struct RawField {
  LayoutField field;
  std::string structure = {};  ///< "geometry_msgs/Vector3" or "Vector3"; empty: the type is a plain one
};

struct RawType {
  std::vector<RawField> fields;
  std::vector<LayoutConstant> constants = {};
  Extensibility extensibility = Extensibility::unspecified;
};

/// By "package/Type".
using RawTypes = std::map<std::string, RawType, std::less<>>;

/// The fields of one .msg file; `is_ros2`: its words are those of ROS 2. Throws BadDefinition.
[[nodiscard]] RawType parse_msg(std::string_view text, bool is_ros2);

/// "package/Type" of the definition that is built in; empty: none is.
[[nodiscard]] std::string_view built_in_definition(std::string_view short_name);

/// The layout of a type whose structures are among these or, if `is_ros2`, built in.
[[nodiscard]] Layout resolve(RawTypes types, std::string_view root, bool is_ros2);

/// The sections of a definition: what stands before, between and after lines of '='. Of each but the first,
/// the first line names its type after "MSG: " or "IDL: ".
struct DefinitionSection {
  std::string type;  ///< short
  std::string_view text;
};
[[nodiscard]] std::vector<DefinitionSection> sections_of(std::string_view type, std::string_view definition);

}  // namespace trundle::logs
