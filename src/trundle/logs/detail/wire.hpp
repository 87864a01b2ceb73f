#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "trundle/logs/detail/byte_cursor.hpp"
#include "trundle/logs/log.hpp"

namespace trundle::logs {

/// Bytes of one element, by FieldType: of text its length, of structures none.
inline constexpr std::array<std::uint8_t, 18> kElementBytes = {1, 1, 1, 2, 2, 4, 4, 8, 8,
                                                               2, 4, 8, 4, 4, 1, 8, 8, 0};
[[nodiscard]] inline std::size_t bytes_of(FieldType type) {
  return kElementBytes[static_cast<std::size_t>(type)];
}

/// A place in the bytes of a message, which goes from field to field as its layout says. A copy is a place of
/// its own. Once bytes are missing, `is_good()` is false and nothing is taken any more.
class Wire {
 public:
  Wire(const Layout& layout, Encoding encoding, std::span<const std::byte> bytes);

  [[nodiscard]] bool is_good() const { return is_good_; }
  [[nodiscard]] std::size_t left() const { return static_cast<std::size_t>(end_ - at_); }

  /// The number of a field's elements: of a dynamic array it is taken off the bytes. 0 where the bytes cannot
  /// be so many, or the elements have no bytes.
  std::uint64_t take_count(const LayoutField& field);
  /// One element of what is a value, structures that are times included.
  Value take_value(const LayoutField& field);
  void skip_elements(const LayoutField& field, std::uint64_t count);
  void skip_field(const LayoutField& field);
  /// Into a structure. Where its length stands before it (XCDR2), nothing behind its end is taken until
  /// leave(), which goes there: a writer with a later definition has written more fields, one with an earlier
  /// fewer. Of others null.
  const std::byte* enter(const LayoutStructure& structure);
  void leave(const std::byte* outer_end);
  /// A field that is a value though it is an array: text of a fixed length.
  [[nodiscard]] static bool is_text_array(const LayoutField& field) {
    return field.type == FieldType::character && field.arity != FieldArity::dynamic;
  }

 private:
  /// The number at the place, after its padding.
  template <class Number>
  Number take() {
    Number number{};
    const std::byte* const from = take_bytes(sizeof number, sizeof number);
    if (from == nullptr) return number;
    std::array<std::byte, sizeof number> bytes;
    std::copy_n(from, sizeof number, bytes.begin());
    if (is_big_endian_) std::ranges::reverse(bytes);
    std::memcpy(&number, bytes.data(), sizeof number);
    return number;
  }
  void take_header(std::span<const std::byte> bytes);
  const std::byte* take_bytes(std::uint64_t count, std::size_t alignment);
  void skip_structures(const LayoutStructure& structure, std::uint64_t count);
  Value take_text();
  Value take_fixed_text(const LayoutField& field);
  Value take_time_structure(const LayoutStructure& structure);
  Value take_time(bool is_signed);
  Value take_number(const LayoutField& field);
  Value take_plain_number(FieldType type);
  Value fail() {
    is_good_ = false;
    return {};
  }

  const Layout* layout_;
  const std::byte* origin_ = nullptr;  ///< that alignment counts from
  const std::byte* at_ = nullptr;
  const std::byte* end_ = nullptr;
  std::size_t most_alignment_ = 1;  ///< of CDR: XCDR2 aligns numbers of 8 bytes to 4
  bool is_cdr_ = false;
  bool is_version_2_ = false;
  bool delimits_unspecified_ = false;  ///< structures whose extensibility is not said
  bool is_big_endian_ = false;
  bool is_good_ = true;
};

}  // namespace trundle::logs
