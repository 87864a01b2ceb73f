#pragma once

#include <deque>
#include <filesystem>
#include <memory>
#include <vector>

#include "trundle/logs/log.hpp"

namespace trundle::logs {

// The readers, each in its own source. All throw InputError where the head of the file cannot be read.
[[nodiscard]] std::unique_ptr<Log> open_rosbag(const std::filesystem::path& path, const Limits& limits);
[[nodiscard]] std::unique_ptr<Log> open_mcap(const std::filesystem::path& path, const Limits& limits);
[[nodiscard]] std::unique_ptr<Log> open_sqlite_bag(const std::filesystem::path& path, const Limits& limits);
/// The files that a folder must hold if rosbag2 was recording into it when it was killed, before it wrote
/// metadata.yaml: NAME_0.db3, NAME_1.db3, ... of the folder NAME, or .mcap. In their order.
[[nodiscard]] std::vector<std::string> rosbag2_files_in(const std::filesystem::path& folder);
/// A folder with metadata.yaml, or such files.
[[nodiscard]] std::unique_ptr<Log> open_rosbag2(const std::filesystem::path& folder, const Limits& limits);
[[nodiscard]] std::unique_ptr<Log> open_zstd(const std::filesystem::path& path, const Limits& limits);
[[nodiscard]] std::unique_ptr<Log> open_wpilog(const std::filesystem::path& path, const Limits& limits);
[[nodiscard]] std::unique_ptr<Log> open_dataflash(const std::filesystem::path& path, const Limits& limits);
[[nodiscard]] std::unique_ptr<Log> open_ulog(const std::filesystem::path& path, const Limits& limits);

/// The channels of a log: they stay where they are.
class ChannelList {
 public:
  Channel& add(Channel channel) {
    channels_.push_back(std::move(channel));
    pointers_.push_back(&channels_.back());
    return channels_.back();
  }
  /// Whether one more channel, with so many bytes of texts, is within the limits; they are counted.
  [[nodiscard]] bool takes(std::size_t bytes, const Limits& limits) {
    bytes_ += bytes;
    return channels_.size() < limits.most_channels && bytes_ <= limits.all_definitions;
  }
  [[nodiscard]] std::span<const Channel* const> all() const { return pointers_; }
  [[nodiscard]] std::size_t size() const { return channels_.size(); }

 private:
  std::deque<Channel> channels_;
  std::vector<const Channel*> pointers_;
  std::size_t bytes_ = 0;
};

}  // namespace trundle::logs
