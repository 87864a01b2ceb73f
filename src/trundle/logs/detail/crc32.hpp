#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "trundle/namespaces.hpp"

namespace trundle::logs {

/// CRC-32 of IEEE 802.3, as MCAP and zip have it. `before`: that of the bytes before these.
[[nodiscard]] std::uint32_t crc32_of(std::span<const std::byte> bytes, std::uint32_t before = 0);

}  // namespace trundle::logs
