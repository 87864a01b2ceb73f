/// What the targets have in common: an input as a file or a folder in memory, and what a reader may do with
/// it.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>

#include "trundle/io/error.hpp"
#include "trundle/io/file.hpp"

namespace trundle::fuzz {

inline std::string_view text_of(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

/// In memory, empty again for each input.
class Folder {
 public:
  Folder() {
    std::error_code error;
    const bool has_memory = std::filesystem::is_directory("/dev/shm", error);
    const std::filesystem::path parent = has_memory ? "/dev/shm" : std::filesystem::temp_directory_path();
    std::string name = parent / "trundle_fuzz_XXXXXX";
    if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
    path_ = name;
  }
  ~Folder() {
    std::error_code error;
    std::filesystem::remove_all(path_, error);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path write(std::string_view name, std::string_view content) const {
    std::ofstream(path_ / name, std::ios::binary) << content;  // whatever it holds
    return path_ / name;
  }
  /// Several files in one input: each begins with a line "=== name"; its name stays within the folder.
  void write_all(std::string_view files) const {
    constexpr std::string_view kHead = "=== ";
    while (files.starts_with(kHead)) {
      const std::size_t line_end = std::min(files.find('\n'), files.size());
      const std::string name(files.substr(kHead.size(), line_end - kHead.size()));
      files.remove_prefix(std::min(line_end + 1, files.size()));
      const std::size_t next = files.starts_with(kHead) ? 0 : files.find("\n=== ");
      const bool is_last = next == files.npos;
      const std::size_t end = is_last ? files.size() : (next == 0 ? 0 : next + 1);
      if (is_plain(name)) write(name, files.substr(0, end));
      files.remove_prefix(end);
    }
  }
  void clear() const {
    for (const auto& entry : std::filesystem::directory_iterator(path_)) std::filesystem::remove_all(entry);
  }

 private:
  static bool is_plain(const std::string& name) {
    return !name.empty() && name.size() < 100 &&
           name.find_first_of(std::string_view("/\\\0", 3)) == name.npos && name != "." && name != "..";
  }

  std::filesystem::path path_;
};

/// Does it, or is refused as the program would refuse it. Any other exception ends the target: a bug.
template <class Read>
int try_to(Read read) {
  try {
    read();
  } catch (const std::exception& error) {
    if (io::exit_code_of(error) == io::kBug) throw;
  }
  return 0;
}

/// What a target claims besides that it does not crash.
inline void require(bool holds) {
  if (!holds) std::abort();
}

}  // namespace trundle::fuzz
