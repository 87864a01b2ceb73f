#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>

#include "trundle/logs/detail/byte_cursor.hpp"

namespace trundle::logs {

/// Numbers and texts one behind the other, the lowest byte first: what ByteCursor takes apart.
class ByteWriter {
 public:
  template <class Number>
  requires std::is_arithmetic_v<Number> ByteWriter& put(Number number) {
    bytes_.append(reinterpret_cast<const char*>(&number), sizeof number);
    return *this;
  }
  ByteWriter& raw(std::string_view bytes) {
    bytes_ += bytes;
    return *this;
  }
  /// After its length, of 32 bits.
  ByteWriter& text(std::string_view text) { return put(static_cast<std::uint32_t>(text.size())).raw(text); }

  [[nodiscard]] std::string_view bytes() const { return bytes_; }
  [[nodiscard]] std::size_t size() const { return bytes_.size(); }
  void clear() { bytes_.clear(); }

 private:
  std::string bytes_;
};

}  // namespace trundle::logs
