#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <span>
#include <vector>

#include "trundle/namespaces.hpp"

namespace trundle::logs {

/// The bytes of a file from a place on, which moves: only what is looked at is in memory.
class FileWindow {
 public:
  /// Read at once, so that records of some bytes do not each cost a call [bytes].
  static constexpr std::size_t kBlock = std::size_t{1} << 18;

  /// `block`: less where it goes to and fro. Throws InputError where the file cannot be opened, or is a
  /// folder, pipe or device.
  explicit FileWindow(const std::filesystem::path& path, std::size_t block = kBlock);

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// When it was opened [bytes].
  [[nodiscard]] std::uint64_t size() const { return size_; }
  [[nodiscard]] std::uint64_t position() const { return position_; }
  [[nodiscard]] std::uint64_t left() const { return position_ < size_ ? size_ - position_ : 0; }
  /// The next `count` bytes, fewer where the file ends; valid until the next call of any kind. What is asked
  /// for is kept in memory: check it against a limit first.
  [[nodiscard]] std::span<const std::byte> peek(std::size_t count);
  void skip(std::uint64_t count) { position_ += count; }
  void seek(std::uint64_t position) { position_ = position; }

 private:
  std::filesystem::path path_;
  std::ifstream in_;
  std::size_t block_;
  std::uint64_t size_ = 0;
  std::uint64_t position_ = 0;
  std::uint64_t buffer_start_ = 0;
  std::vector<std::byte> buffer_;
  std::size_t filled_ = 0;
};

}  // namespace trundle::logs
