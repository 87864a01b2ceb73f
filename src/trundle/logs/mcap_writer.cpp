#include "trundle/logs/mcap_writer.hpp"

#include <algorithm>
#include <cassert>
#include <new>
#include <span>
#include <stdexcept>

#include <fmt/format.h>
#include <zstd.h>

#include "trundle/logs/definitions.hpp"
#include "trundle/logs/detail/crc32.hpp"
#include "trundle/logs/detail/mcap_format.hpp"

namespace trundle::logs {
namespace {

/// Readers hold at least one of them, and more where times overlap; smaller ones compress worse.
constexpr std::size_t kChunkBytes = std::size_t{1} << 20;

std::string record_of(std::uint8_t opcode, std::string_view content) {
  ByteWriter record;
  record.put(opcode).put(static_cast<std::uint64_t>(content.size())).raw(content);
  return std::string(record.bytes());
}

std::string record_of(Opcode opcode, const ByteWriter& content) {
  return record_of(static_cast<std::uint8_t>(opcode), content.bytes());
}

/// A map, after its length in bytes.
template <class Map>
std::string text_map(const Map& map) {
  ByteWriter entries;
  for (const auto& [key, value] : map) entries.text(key).text(value);
  return std::string(ByteWriter().text(entries.bytes()).bytes());
}

}  // namespace

struct McapWriter::Compressor {
  Compressor() : context(ZSTD_createCCtx()) {
    if (context == nullptr) throw std::bad_alloc();
  }
  ~Compressor() { ZSTD_freeCCtx(context); }
  Compressor(const Compressor&) = delete;
  Compressor& operator=(const Compressor&) = delete;

  std::string_view compress(std::string_view bytes) {
    out.resize(ZSTD_compressBound(bytes.size()));
    const std::size_t size =
        ZSTD_compressCCtx(context, out.data(), out.size(), bytes.data(), bytes.size(), ZSTD_CLEVEL_DEFAULT);
    if (ZSTD_isError(size) != 0U) throw std::runtime_error(ZSTD_getErrorName(size));
    return std::string_view(out).substr(0, size);
  }

  ZSTD_CCtx* context;
  std::string out;
};

void McapWriter::Span::include(std::uint64_t time_ns) {
  first_ns = std::min(first_ns, time_ns);
  last_ns = std::max(last_ns, time_ns);
}

McapWriter::McapWriter(const TakeText& take, std::string_view library)
    : take_(take), compressor_(std::make_unique<Compressor>()) {
  write(kMcapMagic);
  write(record_of(Opcode::header, ByteWriter().text("ros2").text(library)));
}

McapWriter::~McapWriter() = default;

void McapWriter::write(std::string_view bytes) {
  crc_ = crc32_of(std::as_bytes(std::span(bytes)), crc_);
  position_ += bytes.size();
  take_(bytes);
}

void McapWriter::add_metadata(std::string_view name, const std::map<std::string, std::string>& entries) {
  const std::string record = record_of(Opcode::metadata, ByteWriter().text(name).raw(text_map(entries)));
  metadata_indices_.raw(
      record_of(Opcode::metadata_index,
                ByteWriter().put(position_).put(static_cast<std::uint64_t>(record.size())).text(name)));
  ++metadata_;
  write(record);
}

std::uint16_t McapWriter::add_channel(std::string_view topic, std::string_view type) {
  std::uint16_t& schema = schema_ids_[std::string(type)];
  if (schema == 0) {  // which stands for "none"
    schema = static_cast<std::uint16_t>(schema_ids_.size());
    const std::string definition = Definitions().find(type);
    assert(!definition.empty());
    const std::string record =
        record_of(Opcode::schema, ByteWriter().put(schema).text(type).text("ros2msg").text(definition));
    schemas_.raw(record);
    chunk_.raw(record);
  }
  const auto channel = static_cast<std::uint16_t>(counts_.size());
  // The profile of ROS 2 asks for the quality of service; empty, its player takes what is usual.
  constexpr std::pair<std::string_view, std::string_view> kQuality{"offered_qos_profiles", ""};
  const std::string record = record_of(
      Opcode::channel,
      ByteWriter().put(channel).put(schema).text(topic).text("cdr").raw(text_map(std::span(&kQuality, 1))));
  channels_.raw(record);
  chunk_.raw(record);
  counts_.push_back(0);
  index_.emplace_back();
  return channel;
}

void McapWriter::add(std::uint16_t channel, std::int64_t time_ns, std::string_view message) {
  assert(time_ns >= 0 && channel < counts_.size());
  const auto time = static_cast<std::uint64_t>(time_ns);
  index_[channel].emplace_back(time, chunk_.size());
  constexpr std::size_t kHead = sizeof channel + sizeof(std::uint32_t) + 2 * sizeof time;
  chunk_.put(static_cast<std::uint8_t>(Opcode::message))
      .put(static_cast<std::uint64_t>(kHead + message.size()))
      .put(channel)
      .put(counts_[channel]++)
      .put(time)  // when it was logged, and published
      .put(time)
      .raw(message);
  chunk_span_.include(time);
  if (chunk_.size() >= kChunkBytes) end_chunk();
}

void McapWriter::end_chunk() {
  if (chunk_.size() == 0) return;
  const std::string_view compressed = compressor_->compress(chunk_.bytes());
  const auto uncompressed_size = static_cast<std::uint64_t>(chunk_.size());
  const auto compressed_size = static_cast<std::uint64_t>(compressed.size());
  const std::uint64_t start = position_;
  write(record_of(Opcode::chunk, ByteWriter()
                                     .put(chunk_span_.start_ns())
                                     .put(chunk_span_.last_ns)
                                     .put(uncompressed_size)
                                     .put(crc32_of(std::as_bytes(std::span(chunk_.bytes()))))
                                     .text("zstd")
                                     .put(compressed_size)
                                     .raw(compressed)));
  const std::uint64_t length = position_ - start;
  const std::uint64_t index_start = position_;
  ByteWriter places;
  for (std::size_t channel = 0; channel < index_.size(); ++channel) {
    auto& entries = index_[channel];
    if (entries.empty()) continue;
    std::ranges::stable_sort(entries, {}, &std::pair<std::uint64_t, std::uint64_t>::first);
    places.put(static_cast<std::uint16_t>(channel)).put(position_);
    ByteWriter content;
    for (const auto& [time, offset] : entries) content.put(time).put(offset);
    write(record_of(Opcode::message_index,
                    ByteWriter().put(static_cast<std::uint16_t>(channel)).text(content.bytes())));
    entries.clear();
  }
  chunk_indices_.raw(record_of(Opcode::chunk_index, ByteWriter()
                                                        .put(chunk_span_.start_ns())
                                                        .put(chunk_span_.last_ns)
                                                        .put(start)
                                                        .put(length)
                                                        .text(places.bytes())
                                                        .put(position_ - index_start)
                                                        .text("zstd")
                                                        .put(compressed_size)
                                                        .put(uncompressed_size)));
  ++chunks_;
  if (chunk_span_.first_ns <= chunk_span_.last_ns) {
    span_.include(chunk_span_.first_ns);
    span_.include(chunk_span_.last_ns);
  }
  chunk_span_ = {};
  chunk_.clear();
}

void McapWriter::write_group(std::uint8_t opcode, std::string_view records, ByteWriter& offsets) {
  if (records.empty()) return;
  offsets.raw(record_of(Opcode::summary_offset, ByteWriter().put(opcode).put(position_).put(
                                                    static_cast<std::uint64_t>(records.size()))));
  write(records);
}

void McapWriter::finish() {
  end_chunk();
  write(record_of(Opcode::data_end, ByteWriter().put(crc_)));
  const std::uint64_t summary = position_;
  crc_ = 0;
  ByteWriter counts;
  std::uint64_t messages = 0;
  for (std::size_t channel = 0; channel < counts_.size(); ++channel) {
    counts.put(static_cast<std::uint16_t>(channel)).put(static_cast<std::uint64_t>(counts_[channel]));
    messages += counts_[channel];
  }
  const std::string statistics =
      record_of(Opcode::statistics, ByteWriter()
                                        .put(messages)
                                        .put(static_cast<std::uint16_t>(schema_ids_.size()))
                                        .put(static_cast<std::uint32_t>(counts_.size()))
                                        .put(std::uint32_t{0})  // attachments
                                        .put(metadata_)
                                        .put(chunks_)
                                        .put(span_.start_ns())
                                        .put(span_.last_ns)
                                        .text(counts.bytes()));
  ByteWriter offsets;
  const auto group = [&](Opcode opcode, std::string_view records) {
    write_group(static_cast<std::uint8_t>(opcode), records, offsets);
  };
  group(Opcode::schema, schemas_.bytes());
  group(Opcode::channel, channels_.bytes());
  group(Opcode::statistics, statistics);
  group(Opcode::chunk_index, chunk_indices_.bytes());
  group(Opcode::metadata_index, metadata_indices_.bytes());
  const std::uint64_t offsets_start = position_;
  write(offsets.bytes());
  // The checksum of the summary ends before itself, within the record.
  ByteWriter footer;
  footer.put(static_cast<std::uint8_t>(Opcode::footer))
      .put(std::uint64_t{2 * sizeof(std::uint64_t) + sizeof(std::uint32_t)})
      .put(summary)
      .put(offsets_start);
  write(footer.bytes());
  write(ByteWriter().put(crc_).bytes());
  write(kMcapMagic);
}

}  // namespace trundle::logs
