#pragma once

#include <cstdint>
#include <string_view>

#include "trundle/namespaces.hpp"

// https://mcap.dev/spec: records of an opcode, a length of 64 bits and content; the same ones within chunks.
namespace trundle::logs {

inline constexpr std::string_view kMcapMagic{"\x89MCAP0\r\n", 8};

enum class Opcode : std::uint8_t {
  none = 0x00,
  header = 0x01,
  footer = 0x02,
  schema = 0x03,
  channel = 0x04,
  message = 0x05,
  chunk = 0x06,
  message_index = 0x07,
  chunk_index = 0x08,
  statistics = 0x0B,
  metadata = 0x0C,
  metadata_index = 0x0D,
  summary_offset = 0x0E,
  data_end = 0x0F,
};

}  // namespace trundle::logs
