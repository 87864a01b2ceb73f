#include <array>
#include <string_view>
#include <system_error>

#include "trundle/io/error.hpp"
#include "trundle/logs/detail/byte_cursor.hpp"
#include "trundle/logs/detail/file_window.hpp"
#include "trundle/logs/detail/formats.hpp"

namespace trundle::logs {
namespace {

namespace fs = std::filesystem;

struct Format {
  std::string_view magic;  ///< the first bytes of the file
  std::unique_ptr<Log> (*open)(const fs::path&, const Limits&);
};

using namespace std::string_view_literals;
constexpr std::array kFormats = {
    Format{"#ROSBAG V"sv, open_rosbag},
    Format{"\x89MCAP0\r\n"sv, open_mcap},
    Format{"SQLite format 3\0"sv, open_sqlite_bag},
    Format{"\x28\xb5\x2f\xfd"sv, open_zstd},
    Format{"WPILOG"sv, open_wpilog},
    Format{"\xa3\x95"sv, open_dataflash},
    Format{"ULog\x01\x12\x35"sv, open_ulog},
};
constexpr std::size_t kLongestMagic = 16;  // SQLite's

const Format* format_of(const fs::path& path) {
  FileWindow file(path);
  const std::string_view head = text_of(file.peek(kLongestMagic));
  for (const Format& format : kFormats)
    if (head.starts_with(format.magic)) return &format;
  return nullptr;
}

bool is_rosbag2_folder(const fs::path& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) return false;
  return fs::is_regular_file(path / "metadata.yaml", error) || !rosbag2_files_in(path).empty();
}

}  // namespace

std::unique_ptr<Log> open_log(const fs::path& path, const Limits& limits) {
  if (is_rosbag2_folder(path)) return open_rosbag2(path, limits);
  if (fs::is_directory(path))
    throw InputError(path.string(), "is a folder without metadata.yaml, or files named after it",
                     "that of a rosbag2, or the .db3 or .mcap file in it");
  const Format* const format = format_of(path);
  if (format == nullptr)
    throw InputError(
        path.string(),
        fs::is_regular_file(path) && fs::is_empty(path) ? "is empty" : "is no log of a known format",
        "a ROS 1 bag, a rosbag2 (folder, .db3 or .mcap), WPILOG, DataFlash or ULog");
  return format->open(path, limits);
}

bool is_log(const fs::path& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) return is_rosbag2_folder(path);
  return fs::is_regular_file(path, error) && format_of(path) != nullptr;
}

}  // namespace trundle::logs
