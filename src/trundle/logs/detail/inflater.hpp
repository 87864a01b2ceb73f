#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "trundle/namespaces.hpp"

namespace trundle::logs {

enum class Compression { none, bz2, lz4, zstd };

/// By the name that a bag or MCAP gives it; nothing: unknown.
[[nodiscard]] std::optional<Compression> compression_named(std::string_view name);

/// What compressed bytes become.
struct Inflated {
  std::span<const std::byte> bytes;  ///< valid until the next: where there is a fault, what comes before it
  std::string fault = {};            ///< empty: whole
};

/// Decompresses one piece after the other into the same memory, never more than it is told to expect.
class Inflater {
 public:
  Inflater();
  ~Inflater();
  Inflater(Inflater&&) noexcept;
  Inflater& operator=(Inflater&&) noexcept;

  /// `size`: what becomes of them. Not for Compression::none.
  Inflated inflate(Compression compression, std::span<const std::byte> bytes, std::size_t size);
  /// Of a zstd frame that says itself what becomes of it.
  Inflated inflate_frame(std::span<const std::byte> bytes, std::size_t most);

 private:
  struct Contexts;
  std::unique_ptr<Contexts> contexts_;
  std::vector<std::byte> out_;
};

}  // namespace trundle::logs
