#include <fstream>

#include <fmt/format.h>
#include <zstd.h>

#include "trundle/io/error.hpp"
#include "trundle/logs/detail/byte_cursor.hpp"
#include "trundle/logs/detail/file_window.hpp"
#include "trundle/logs/detail/formats.hpp"
#include "trundle/logs/detail/temporary_folder.hpp"

namespace trundle::logs {
namespace {

namespace fs = std::filesystem;

/// What is decompressed: where it is cut, the rest is missing.
struct Decompressed {
  std::uint64_t cut_at = 0;
  std::string fault = {};
};

class FileDecompressor {
 public:
  FileDecompressor(const fs::path& from, const fs::path& to, std::uint64_t most)
      : in_(from),
        out_(to, std::ios::binary),
        most_(most),
        context_(ZSTD_createDCtx()),
        buffer_(ZSTD_DStreamOutSize()) {
    if (context_ == nullptr) throw std::bad_alloc();
  }
  ~FileDecompressor() { ZSTD_freeDCtx(context_); }
  FileDecompressor(const FileDecompressor&) = delete;
  FileDecompressor& operator=(const FileDecompressor&) = delete;

  Decompressed run() {
    std::size_t left = 0;
    while (in_.left() > 0) {
      const std::span<const std::byte> piece = in_.peek(ZSTD_DStreamInSize());
      ZSTD_inBuffer from{piece.data(), piece.size(), 0};
      while (from.pos < from.size) {
        left = take(from);
        if (ZSTD_isError(left) != 0U) return {in_.position(), "the bytes are no zstd frame"};
      }
      in_.skip(piece.size());
    }
    out_.flush();
    if (!out_)
      throw InputError(in_.path().string(), "cannot be decompressed into the folder for temporary files",
                       "room there");
    return left == 0 ? Decompressed{} : Decompressed{in_.position(), "the compressed file breaks off"};
  }

 private:
  std::size_t take(ZSTD_inBuffer& from) {
    ZSTD_outBuffer to{buffer_.data(), buffer_.size(), 0};
    const std::size_t left = ZSTD_decompressStream(context_, &to, &from);
    written_ += to.pos;
    if (written_ > most_)
      throw InputError(in_.path().string(), fmt::format("becomes larger than {} bytes", most_),
                       "a log within the limit");
    out_.write(buffer_.data(), static_cast<std::streamsize>(to.pos));
    return left;
  }

  FileWindow in_;
  std::ofstream out_;
  std::uint64_t most_;
  std::uint64_t written_ = 0;
  ZSTD_DCtx* context_;
  std::vector<char> buffer_;
};

/// The log that was compressed, and its file while it is read.
class Unpacked : public Log {
 public:
  Unpacked(const fs::path& path, const Limits& limits) : path_(path) {
    const fs::path inner =
        folder_.path() /
        (path.extension() == ".zstd" || path.extension() == ".zst" ? path.stem() : path.filename());
    const Decompressed done = FileDecompressor(path, inner, limits.largest_database).run();
    if (!done.fault.empty()) cut_ = Cut{path.string(), done.cut_at, done.fault};
    constexpr std::string_view kZstd = "\x28\xb5\x2f\xfd";
    if (text_of(FileWindow(inner).peek(kZstd.size())) == kZstd)
      throw InputError(path.string(), "is compressed twice", "a log that is compressed once");
    log_ = open_log(inner, limits);
  }

  std::string_view format() const override { return log_->format(); }
  std::span<const Channel* const> channels() const override { return log_->channels(); }
  std::optional<Message> next() override {
    std::optional<Message> message = log_->next();
    if (!message && !cut_ && log_->cut()) {
      cut_ = log_->cut();
      cut_->place = path_.string();  // not that of the file that is gone afterwards
    }
    return message;
  }
  const std::optional<Cut>& cut() const override { return cut_; }

 private:
  fs::path path_;
  TemporaryFolder folder_;
  std::unique_ptr<Log> log_;
  std::optional<Cut> cut_;
};

}  // namespace

std::unique_ptr<Log> open_zstd(const fs::path& path, const Limits& limits) {
  return std::make_unique<Unpacked>(path, limits);
}

}  // namespace trundle::logs
