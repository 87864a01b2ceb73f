#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <string_view>

#include "trundle/namespaces.hpp"

namespace trundle::io {

/// Takes a text piece by piece.
using TakeText = std::function<void(std::string_view)>;

/// Gives a text piece by piece: each is good until the next is asked for, an empty one is its end.
using NextText = std::function<std::string_view()>;

/// The bytes of a file, of which only a piece at a time is in memory.
class FilePieces {
 public:
  /// Throws InputError where the file cannot be opened, or is a folder, pipe or device.
  explicit FilePieces(const std::filesystem::path& path);

  /// Empty at the end of the file. Throws InputError where it cannot be read.
  [[nodiscard]] std::string_view next();
  /// When it was opened: it may grow yet [bytes].
  [[nodiscard]] std::uintmax_t size() const { return size_; }

 private:
  std::filesystem::path path_;
  std::ifstream in_;
  std::uintmax_t size_ = 0;
  std::string piece_;
};

/// As write_file, of a text that is never all in memory: `produce` hands its pieces on.
void write_file(const std::filesystem::path& path, const std::function<void(const TakeText&)>& produce);

}  // namespace trundle::io
