#include <map>
#include <utility>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/io/file.hpp"
#include "trundle/logs/detail/formats.hpp"

namespace trundle::logs {
namespace {

namespace fs = std::filesystem;

/// The items of `relative_file_paths` in metadata.yaml, as rosbag2 writes it: an item a line, after "- ".
std::vector<std::string> files_named_in(std::string_view yaml) {
  std::vector<std::string> files;
  bool is_list = false;
  while (!yaml.empty()) {
    const std::size_t end = std::min(yaml.find('\n'), yaml.size());
    std::string_view line = yaml.substr(0, end);
    yaml.remove_prefix(std::min(end + 1, yaml.size()));
    const std::size_t start = line.find_first_not_of(" \t");
    if (start == line.npos) continue;
    line = line.substr(start, line.find_last_not_of(" \t\r") - start + 1);
    if (line == "relative_file_paths:") {
      is_list = true;
    } else if (is_list && line.starts_with("- ")) {
      line.remove_prefix(2);
      if (line.size() >= 2 && (line.front() == '"' || line.front() == '\''))
        line = line.substr(1, line.size() - 2);
      files.emplace_back(line);
    } else {
      is_list = false;
    }
  }
  return files;
}

/// Bags that were split, one after the other. A topic of several files is one channel.
class SplitBag : public Log {
 public:
  SplitBag(const fs::path& folder, const Limits& limits) {
    const std::vector<std::string> names = fs::exists(folder / "metadata.yaml")
                                               ? files_named_in(read_file(folder / "metadata.yaml"))
                                               : rosbag2_files_in(folder);
    if (names.empty())
      throw InputError((folder / "metadata.yaml").string(), "names no file under relative_file_paths",
                       "the metadata that rosbag2 writes, or the .db3 or .mcap file itself");
    for (const std::string& name : names) {
      const fs::path file = file_of(folder, name);
      // The last one is where recording was killed, perhaps before it held anything.
      const bool may_be_unreadable = !logs_.empty() && &name == &names.back() && fs::exists(file);
      try {
        logs_.push_back(open_log(file, limits));
      } catch (const InputError& error) {
        if (!may_be_unreadable) throw;
        unreadable_ = Cut{folder.string(), 0, fmt::format("its last file is left out: {}", error.what())};
        break;
      }
      note_channels(*logs_.back());
    }
  }

  std::string_view format() const override { return logs_.front()->format(); }
  std::span<const Channel* const> channels() const override { return channels_.all(); }
  const std::optional<Cut>& cut() const override { return cut_; }

  std::optional<Message> next() override {
    for (; current_ < logs_.size(); ++current_) {
      std::optional<Message> message = logs_[current_]->next();
      if (message) {
        if (!by_original_.contains(message->channel)) note_channels(*logs_[current_]);
        message->channel = by_original_.at(message->channel);
        return message;
      }
      if (logs_[current_]->cut() && !cut_) cut_ = logs_[current_]->cut();
    }
    if (!cut_) cut_ = unreadable_;
    return std::nullopt;
  }

 private:
  /// Where rosbag2 says, or with the ending that it forgets of compressed files; beside metadata.yaml,
  /// whatever folder it was recorded in.
  static fs::path file_of(const fs::path& folder, const std::string& name) {
    const fs::path plain = folder / fs::path(name).filename();
    const fs::path compressed = plain.string() + ".zstd";
    return fs::exists(plain) || !fs::exists(compressed) ? plain : compressed;
  }

  void note_channels(const Log& log) {
    for (const Channel* const channel : log.channels()) {
      if (by_original_.contains(channel)) continue;
      Channel*& mine = by_name_[{channel->topic, channel->type}];
      if (mine == nullptr) {
        mine = &channels_.add(*channel);
      } else if (mine->messages && channel->messages) {
        *mine->messages += *channel->messages;
      }
      by_original_[channel] = mine;
    }
  }

  std::vector<std::unique_ptr<Log>> logs_;
  std::size_t current_ = 0;
  ChannelList channels_;
  std::map<std::pair<std::string, std::string>, Channel*> by_name_;
  std::map<const Channel*, const Channel*> by_original_;
  std::optional<Cut> unreadable_;  ///< the last file
  std::optional<Cut> cut_;
};

}  // namespace

std::vector<std::string> rosbag2_files_in(const fs::path& folder) {
  std::error_code error;
  const std::string stem = fs::weakly_canonical(folder, error).filename().string() + "_";
  std::vector<std::string> names;
  for (const std::string_view ending : {".db3", ".mcap"})
    for (std::size_t number = 0;; ++number) {
      const std::string name = fmt::format("{}{}{}", stem, number, ending);
      if (!fs::is_regular_file(folder / name, error) &&
          !fs::is_regular_file(folder / (name + ".zstd"), error))
        break;
      names.push_back(name);
    }
  return names;
}

std::unique_ptr<Log> open_rosbag2(const fs::path& folder, const Limits& limits) {
  return std::make_unique<SplitBag>(folder, limits);
}

}  // namespace trundle::logs
