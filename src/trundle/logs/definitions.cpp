#include "trundle/logs/definitions.hpp"

#include <set>
#include <system_error>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/io/file.hpp"
#include "trundle/logs/detail/raw_types.hpp"

namespace trundle::logs {
namespace {

namespace fs = std::filesystem;

/// "<package>/msg/<Type>.msg" and "<package>/<Type>.msg" are "package/Type".
std::string type_of(const fs::path& file) {
  fs::path folder = file.parent_path();
  if (folder.filename() == "msg") folder = folder.parent_path();
  return folder.filename().string() + "/" + file.stem().string();
}

/// Appends the definitions of all types that one uses; false where one of them is not known.
class Collector {
 public:
  explicit Collector(const std::map<std::string, std::string, std::less<>>& folders) : folders_(folders) {}

  bool add(const std::string& type) {
    if (!seen_.insert(type).second) return true;
    const auto found = folders_.find(type);
    const std::string_view text =
        found != folders_.end() ? std::string_view(found->second) : built_in_definition(type);
    if (text.empty() && found == folders_.end()) return false;
    definition_ +=
        seen_.size() == 1 ? std::string(text) : fmt::format("\n{:=<80}\nMSG: {}\n{}", "", type, text);
    const std::string package = type.substr(0, type.find('/'));
    bool is_whole = true;
    for (const RawField& field : parse_msg(text, true).fields) {
      if (field.structure.empty()) continue;
      const bool is_full = field.structure.find('/') != std::string::npos;
      const std::string inner =
          field.structure == "Header" ? "std_msgs/Header" : (is_full ? "" : package + "/") + field.structure;
      is_whole = add(inner) && is_whole;
    }
    return is_whole;
  }
  std::string take() { return std::move(definition_); }

 private:
  const std::map<std::string, std::string, std::less<>>& folders_;
  std::set<std::string> seen_;
  std::string definition_;
};

}  // namespace

Definitions::Definitions(const std::vector<fs::path>& folders) {
  for (const fs::path& folder : folders) {
    if (!fs::is_directory(folder))
      throw InputError(folder.string(), "is no folder",
                       "a folder with .msg files, of a ROS package or several");
    for (const auto& entry : fs::recursive_directory_iterator(folder))
      if (entry.path().extension() == ".msg" && entry.is_regular_file())
        of_folders_.try_emplace(type_of(entry.path()), read_file(entry.path()));
  }
}

std::string Definitions::find(std::string_view type) const {
  Collector collector(of_folders_);
  return collector.add(short_type_name(type)) ? collector.take() : std::string();
}

Layout layout_of(const Channel& channel, const Definitions& definitions) {
  if (!channel.unreadable.empty()) throw BadDefinition(channel.unreadable);
  if (channel.layout) return *channel.layout;
  switch (channel.language) {
    case SchemaLanguage::ros1msg:
      return parse_ros1msg(channel.type, channel.definition);
    case SchemaLanguage::ros2msg:
      return parse_ros2msg(channel.type, channel.definition);
    case SchemaLanguage::ros2idl:
      return parse_ros2idl(channel.type, channel.definition);
    case SchemaLanguage::none:
      break;
  }
  if (channel.encoding != Encoding::cdr)
    throw BadDefinition(fmt::format("messages of type {} have no definition", channel.type));
  const std::string found = definitions.find(channel.type);
  if (found.empty())
    throw BadDefinition(
        fmt::format("the type {}, or one that it uses, is defined neither in the log nor in Trundle: "
                    "--msg-path names a folder with its .msg file",
                    channel.type));
  return parse_ros2msg(channel.type, found);
}

}  // namespace trundle::logs
