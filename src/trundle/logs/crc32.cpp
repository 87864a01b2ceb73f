#include "trundle/logs/detail/crc32.hpp"

#include <array>
#include <cstring>

namespace trundle::logs {
namespace {

constexpr std::size_t kSlices = 8;  // bytes at once: a word of the machine
using CrcTables = std::array<std::array<std::uint32_t, 256>, kSlices>;

/// Slicing by 8: table k is of a byte that k more follow.
constexpr CrcTables crc_tables() {
  constexpr std::uint32_t kPolynomial = 0xEDB88320;  // reversed
  CrcTables tables{};
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    std::uint32_t crc = byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1) != 0 ? kPolynomial : 0);
    tables[0][byte] = crc;
  }
  for (std::size_t k = 1; k < kSlices; ++k)
    for (std::size_t byte = 0; byte < 256; ++byte)
      tables[k][byte] = (tables[k - 1][byte] >> 8) ^ tables[0][tables[k - 1][byte] & 0xFF];
  return tables;
}

constexpr CrcTables kCrcTables = crc_tables();

}  // namespace

std::uint32_t crc32_of(std::span<const std::byte> bytes, std::uint32_t before) {
  const CrcTables& t = kCrcTables;
  std::uint32_t crc = ~before;
  for (; bytes.size() >= kSlices; bytes = bytes.subspan(kSlices)) {
    std::array<std::uint32_t, 2> words;
    std::memcpy(words.data(), bytes.data(), sizeof words);
    words[0] ^= crc;
    const auto low = [&](std::uint32_t word, std::size_t k) {
      return t[k][word & 0xFF] ^ t[k - 1][(word >> 8) & 0xFF] ^ t[k - 2][(word >> 16) & 0xFF] ^
             t[k - 3][word >> 24];
    };
    crc = low(words[0], 7) ^ low(words[1], 3);
  }
  for (const std::byte byte : bytes) crc = (crc >> 8) ^ t[0][(crc ^ static_cast<std::uint32_t>(byte)) & 0xFF];
  return ~crc;
}

}  // namespace trundle::logs
