#pragma once

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>

#include "trundle/io/file.hpp"

namespace trundle::test {
using namespace recording;

/// A folder of its own for each object, gone with it.
class Folder {
 public:
  Folder() {
    std::string name = (std::filesystem::temp_directory_path() / "trundle_recording_XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
    path_ = std::filesystem::path(name) / "tour" / "run";
    std::filesystem::create_directories(path_);
  }
  ~Folder() { std::filesystem::remove_all(path_.parent_path().parent_path()); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  /// Writes a file and returns where.
  std::filesystem::path write(const std::string& name, std::string_view content) const {
    std::filesystem::create_directories((path_ / name).parent_path());
    std::ofstream(path_ / name, std::ios::binary) << content;  // whatever it holds
    return path_ / name;
  }

 private:
  std::filesystem::path path_;
};

}  // namespace trundle::test
