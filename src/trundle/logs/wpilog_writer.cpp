#include "trundle/logs/wpilog_writer.hpp"

#include <bit>
#include <cassert>

namespace trundle::logs {
namespace {

constexpr std::uint16_t kVersion10 = 0x0100;                 // 1.0
constexpr std::size_t kPendingBytes = std::size_t{1} << 16;  // as much as is written at once
constexpr std::uint32_t kControlEntry = 0;                   // entries of the log itself

/// Bytes that a number needs, at least one.
unsigned bytes_needed(std::uint64_t number) {
  return number == 0 ? 1 : (static_cast<unsigned>(std::bit_width(number)) + 7) / 8;
}

/// Its lowest bytes.
void put_bytes(ByteWriter& out, std::uint64_t number, unsigned count) {
  out.raw({reinterpret_cast<const char*>(&number), count});
}

}  // namespace

WpilogWriter::WpilogWriter(const TakeText& take, std::string_view extra_header) : take_(take) {
  pending_.raw("WPILOG").put(kVersion10).text(extra_header);
}

std::uint32_t WpilogWriter::start(std::string_view name, std::string_view type, std::int64_t time_us) {
  constexpr std::uint8_t kStartRecord = 0;  // of the control entry
  const std::uint32_t entry = ++entries_;
  add(kControlEntry, time_us,
      ByteWriter()
          .put(kStartRecord)
          .put(entry)
          .text(name)
          .text(type)
          .text(R"({"source":"trundle"})")
          .bytes());
  return entry;
}

void WpilogWriter::add(std::uint32_t entry, std::int64_t time_us, std::string_view value) {
  assert(time_us >= 0 && entry <= entries_);
  const auto time = static_cast<std::uint64_t>(time_us);
  const unsigned entry_bytes = bytes_needed(entry), size_bytes = bytes_needed(value.size()),
                 time_bytes = bytes_needed(time);
  pending_.put(
      static_cast<std::uint8_t>((entry_bytes - 1) | (size_bytes - 1) << 2U | (time_bytes - 1) << 4U));
  put_bytes(pending_, entry, entry_bytes);
  put_bytes(pending_, value.size(), size_bytes);
  put_bytes(pending_, time, time_bytes);
  pending_.raw(value);
  if (pending_.size() >= kPendingBytes) finish();
}

void WpilogWriter::finish() {
  take_(pending_.bytes());
  pending_.clear();
}

}  // namespace trundle::logs
