#include "trundle/logs/detail/file_window.hpp"

#include <algorithm>
#include <system_error>

#include "trundle/io/error.hpp"

namespace trundle::logs {

FileWindow::FileWindow(const std::filesystem::path& path, std::size_t block) : path_(path), block_(block) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) throw InputError(path.string(), "does not exist", "a log");
  if (!std::filesystem::is_regular_file(path, error))
    throw InputError(path.string(), "is not a file", "a log");
  size_ = std::filesystem::file_size(path, error);
  in_.open(path, std::ios::binary);
  if (error || !in_) throw InputError(path.string(), "cannot be read", "a log");
}

std::span<const std::byte> FileWindow::peek(std::size_t count) {
  const std::uint64_t offset = position_ - buffer_start_;
  if (position_ < buffer_start_ || offset > filled_ || count > filled_ - offset) {
    const bool keeps = position_ >= buffer_start_ && offset < filled_;
    const std::size_t kept = keeps ? filled_ - static_cast<std::size_t>(offset) : 0;
    if (keeps) std::copy_n(buffer_.begin() + static_cast<std::ptrdiff_t>(offset), kept, buffer_.begin());
    buffer_start_ = position_;
    const std::uint64_t most = std::max<std::uint64_t>(left(), kept);
    const auto wanted = static_cast<std::size_t>(std::min<std::uint64_t>(std::max(count, block_), most));
    // What was large once need not stay: chunks are alike, a single record is not.
    buffer_.resize(std::max(wanted, kept));
    in_.clear();
    in_.seekg(static_cast<std::streamoff>(position_ + kept));
    in_.read(reinterpret_cast<char*>(buffer_.data()) + kept,
             static_cast<std::streamsize>(buffer_.size() - kept));
    filled_ = kept + static_cast<std::size_t>(in_.gcount());
    if (in_.bad()) throw InputError(path_.string(), "cannot be read to its end", "a log");
  }
  const auto start = static_cast<std::size_t>(position_ - buffer_start_);
  if (start >= filled_) return {};
  return std::span(buffer_).subspan(start, std::min(count, filled_ - start));
}

}  // namespace trundle::logs
