#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "trundle/logs/log.hpp"

namespace trundle::logs {

/// "geometry_msgs/msg/Vector3" and "geometry_msgs::msg::Vector3" are geometry_msgs/Vector3.
[[nodiscard]] std::string short_type_name(std::string_view type);

/// `definition`: the fields of `type`, then those of each type it uses, after lines of '=' and "MSG: type".
/// Throws BadDefinition.
[[nodiscard]] Layout parse_ros1msg(std::string_view type, std::string_view definition);
[[nodiscard]] Layout parse_ros2msg(std::string_view type, std::string_view definition);
/// "IDL: type" instead of "MSG: type"; the part of IDL that ROS 2 writes.
[[nodiscard]] Layout parse_ros2idl(std::string_view type, std::string_view definition);

/// Definitions of types, for logs that hold none: those of ROS 2's common interfaces are built in, others are
/// found in folders with .msg files.
class Definitions {
 public:
  Definitions() = default;
  /// The .msg files of these folders, or of folders in them: <package>/msg/<Type>.msg or
  /// <package>/<Type>.msg. Throws InputError where a folder cannot be read.
  explicit Definitions(const std::vector<std::filesystem::path>& folders);

  /// The definition of a type ("geometry_msgs/msg/Twist") and of all that it uses, as parse_ros2msg() takes
  /// it; empty: it, or one that it uses, is not known. The folders go before what is built in.
  [[nodiscard]] std::string find(std::string_view type) const;

 private:
  std::map<std::string, std::string, std::less<>> of_folders_;  ///< by "package/Type"
};

/// Of a channel's messages. Throws BadDefinition, also where there is no definition: it says then which type
/// is missing.
[[nodiscard]] Layout layout_of(const Channel& channel, const Definitions& definitions = {});

}  // namespace trundle::logs
