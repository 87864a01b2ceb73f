#include "trundle/logs/detail/inflater.hpp"

#include <new>

#include <bzlib.h>
#include <fmt/format.h>
#include <lz4frame.h>
#include <zstd.h>

namespace trundle::logs {
namespace {

constexpr const char* kCutOff = "the compressed bytes break off";
constexpr const char* kTooMany = "more comes out of the compressed bytes than they announce";

struct Progress {
  std::size_t written = 0;
  std::string fault = {};
};

Progress inflate_bz2(std::span<const std::byte> in, std::span<std::byte> out) {
  bz_stream stream{};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) throw std::bad_alloc();
  stream.next_in = const_cast<char*>(reinterpret_cast<const char*>(in.data()));  // bzlib does not know const
  stream.avail_in = static_cast<unsigned>(in.size());
  stream.next_out = reinterpret_cast<char*>(out.data());
  stream.avail_out = static_cast<unsigned>(out.size());
  int status = BZ_OK;
  while (status == BZ_OK) {
    const unsigned before_in = stream.avail_in;
    const unsigned before_out = stream.avail_out;
    status = BZ2_bzDecompress(&stream);
    if (stream.avail_in == before_in && stream.avail_out == before_out) break;
  }
  Progress progress{out.size() - stream.avail_out};
  const bool is_starved = status == BZ_OK && stream.avail_in == 0;
  if (status != BZ_STREAM_END)
    progress.fault = is_starved ? kCutOff : (status == BZ_OK ? kTooMany : "the bytes are no bzip2");
  BZ2_bzDecompressEnd(&stream);
  return progress;
}

Progress inflate_lz4(LZ4F_dctx* context, std::span<const std::byte> in, std::span<std::byte> out) {
  LZ4F_resetDecompressionContext(context);
  Progress progress;
  for (;;) {
    std::size_t read = in.size();
    std::size_t written = out.size() - progress.written;
    const std::size_t left =
        LZ4F_decompress(context, out.data() + progress.written, &written, in.data(), &read, nullptr);
    if (LZ4F_isError(left) != 0U) {
      progress.fault = "the bytes are no LZ4 frame";
      return progress;
    }
    progress.written += written;
    in = in.subspan(read);
    if (left == 0) return progress;
    if (read == 0 && written == 0) {
      progress.fault = in.empty() ? kCutOff : kTooMany;
      return progress;
    }
  }
}

Progress inflate_zstd(ZSTD_DCtx* context, std::span<const std::byte> in, std::span<std::byte> out) {
  ZSTD_DCtx_reset(context, ZSTD_reset_session_only);
  ZSTD_inBuffer from{in.data(), in.size(), 0};
  ZSTD_outBuffer to{out.data(), out.size(), 0};
  Progress progress;
  for (;;) {
    const std::size_t before_in = from.pos;
    const std::size_t before_out = to.pos;
    const std::size_t left = ZSTD_decompressStream(context, &to, &from);
    progress.written = to.pos;
    const bool stands_still = from.pos == before_in && to.pos == before_out;
    if (ZSTD_isError(left) != 0U)
      progress.fault = "the bytes are no zstd frame";
    else if (left != 0 && stands_still)
      progress.fault = from.pos == from.size ? kCutOff : kTooMany;
    if (!progress.fault.empty() || (left == 0 && (from.pos == from.size || stands_still))) return progress;
  }
}

}  // namespace

struct Inflater::Contexts {
  ZSTD_DCtx* zstd = nullptr;
  LZ4F_dctx* lz4 = nullptr;

  Contexts() {
    zstd = ZSTD_createDCtx();
    if (zstd == nullptr || LZ4F_isError(LZ4F_createDecompressionContext(&lz4, LZ4F_VERSION)) != 0U)
      throw std::bad_alloc();
    // A frame may ask for a window of gigabytes; so large a one the chunks of logs do not need.
    constexpr int kLargestWindow = 26;  // log2 of 64 MB
    ZSTD_DCtx_setParameter(zstd, ZSTD_d_windowLogMax, kLargestWindow);
  }
  ~Contexts() {
    ZSTD_freeDCtx(zstd);
    LZ4F_freeDecompressionContext(lz4);
  }
  Contexts(const Contexts&) = delete;
  Contexts& operator=(const Contexts&) = delete;
};

Inflater::Inflater() : contexts_(std::make_unique<Contexts>()) {}
Inflater::~Inflater() = default;
Inflater::Inflater(Inflater&&) noexcept = default;
Inflater& Inflater::operator=(Inflater&&) noexcept = default;

std::optional<Compression> compression_named(std::string_view name) {
  if (name.empty() || name == "none") return Compression::none;
  if (name == "bz2") return Compression::bz2;
  if (name == "lz4") return Compression::lz4;
  if (name == "zstd") return Compression::zstd;
  return std::nullopt;
}

Inflated Inflater::inflate(Compression compression, std::span<const std::byte> bytes, std::size_t size) {
  if (out_.size() < size) out_.resize(size);
  const std::span<std::byte> out = std::span(out_).first(size);
  Progress progress;
  if (compression == Compression::bz2) progress = inflate_bz2(bytes, out);
  if (compression == Compression::lz4) progress = inflate_lz4(contexts_->lz4, bytes, out);
  if (compression == Compression::zstd) progress = inflate_zstd(contexts_->zstd, bytes, out);
  if (progress.fault.empty() && progress.written < size)
    progress.fault =
        fmt::format("{} bytes come out of the compressed ones instead of {}", progress.written, size);
  return {out.first(progress.written), progress.fault};
}

Inflated Inflater::inflate_frame(std::span<const std::byte> bytes, std::size_t most) {
  const unsigned long long size = ZSTD_getFrameContentSize(bytes.data(), bytes.size());
  if (size == ZSTD_CONTENTSIZE_UNKNOWN || size == ZSTD_CONTENTSIZE_ERROR || size > most)
    return {{}, "a compressed message does not say its size, or is too large"};
  return inflate(Compression::zstd, bytes, static_cast<std::size_t>(size));
}

}  // namespace trundle::logs
