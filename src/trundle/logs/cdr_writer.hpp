#pragma once

#include <concepts>
#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>

#include "trundle/logs/detail/byte_cursor.hpp"

namespace trundle::logs {

/// A message in OMG's Common Data Representation, version 1, the lowest byte first, as ROS 2 serializes it:
/// four bytes of header, then each number at a multiple of its own size behind them.
class CdrWriter {
 public:
  CdrWriter() { clear(); }

  /// Begins the next message in the memory of the last.
  void clear() { bytes_.assign(kHead); }

  template <class Number>
  requires std::is_arithmetic_v<Number> CdrWriter& put(Number number) {
    bytes_.append((sizeof number - (bytes_.size() - kHead.size()) % sizeof number) % sizeof number, '\0');
    bytes_.append(reinterpret_cast<const char*>(&number), sizeof number);
    return *this;
  }
  /// After its length, ended by a zero byte.
  CdrWriter& text(std::string_view text) {
    count(text.size() + 1);
    bytes_ += text;
    bytes_ += '\0';
    return *this;
  }
  /// Of the elements of a sequence, which follow.
  CdrWriter& count(std::size_t elements) { return put(static_cast<std::uint32_t>(elements)); }

  [[nodiscard]] std::string_view bytes() const { return bytes_; }

 private:
  static constexpr std::string_view kHead{"\0\1\0\0", 4};
  std::string bytes_;
};

}  // namespace trundle::logs
