#include "trundle/logs/detail/wire.hpp"

#include <cmath>

namespace trundle::logs {
namespace {

/// The bits of a bit-field, its sign carried on.
template <class Integer>
Integer bits_of(Integer stored, const LayoutField& field, bool is_signed) {
  constexpr unsigned kBits = 64;  // of what it is shifted in
  const unsigned above = kBits - field.bits - field.first_bit;
  const auto raised = static_cast<std::uint64_t>(stored) << above;
  const unsigned down = kBits - field.bits;
  return is_signed ? static_cast<Integer>(static_cast<std::int64_t>(raised) >> down)
                   : static_cast<Integer>(raised >> down);
}

Value part_of(const Value& stored, const LayoutField& field) {
  if (field.bits == 0 || field.bits + field.first_bit > 64) return stored;
  if (const auto* const number = std::get_if<std::int64_t>(&stored)) return bits_of(*number, field, true);
  if (const auto* const number = std::get_if<std::uint64_t>(&stored)) return bits_of(*number, field, false);
  return stored;
}

}  // namespace

Wire::Wire(const Layout& layout, Encoding encoding, std::span<const std::byte> bytes)
    : layout_(&layout), at_(bytes.data()), end_(bytes.data() + bytes.size()) {
  if (encoding == Encoding::json || encoding == Encoding::unknown) is_good_ = false;
  if (encoding == Encoding::cdr) {
    // Its header: the kind of encoding, of two bytes, and two of options. Plain CDR of version 1 alone.
    constexpr std::size_t kHeader = 4;
    is_aligned_ = true;
    if (bytes.size() < kHeader || bytes[0] != std::byte{0} || bytes[1] > std::byte{1}) {
      is_good_ = false;
      return;
    }
    is_big_endian_ = bytes[1] == std::byte{0};
    at_ += kHeader;
  }
  origin_ = at_;
}

const std::byte* Wire::take_bytes(std::uint64_t count, std::size_t alignment) {
  if (!is_good_) return nullptr;
  const auto offset = static_cast<std::size_t>(at_ - origin_);
  const std::size_t padding = is_aligned_ ? (alignment - offset % alignment) % alignment : 0;
  if (padding > left() || count > left() - padding) {
    is_good_ = false;
    return nullptr;
  }
  const std::byte* const from = at_ + padding;
  at_ = from + count;
  return from;
}

std::uint64_t Wire::take_count(const LayoutField& field) {
  const bool is_structure = field.type == FieldType::structure;
  const std::uint64_t least = is_structure ? layout_->least_size(field.structure) : bytes_of(field.type);
  std::uint64_t count = 1;
  if (field.arity == FieldArity::fixed) count = field.count;
  if (field.arity == FieldArity::dynamic) count = take<std::uint32_t>();
  if (field.arity == FieldArity::rest) count = least == 0 ? 0 : left() / least;
  if (!is_good_ || least == 0) return 0;
  if (count > left() / least) {
    is_good_ = false;
    return 0;
  }
  return count;
}

void Wire::skip_structures(const LayoutStructure& structure, std::uint64_t count) {
  for (; count > 0 && is_good_; --count)
    for (const LayoutField& field : structure.fields) skip_field(field);
}

void Wire::skip_elements(const LayoutField& field, std::uint64_t count) {
  if (!is_good_ || count == 0) return;
  switch (field.type) {
    case FieldType::structure:
      return skip_structures(layout_->structures()[field.structure], count);
    case FieldType::string:
      for (; count > 0 && is_good_; --count) take_text();
      return;
    case FieldType::wide_string:
      is_good_ = false;
      return;
    default:
      if (count > left())
        is_good_ = false;
      else if (!field.keeps_place)
        take_bytes(count * bytes_of(field.type), bytes_of(field.type));
  }
}

void Wire::skip_field(const LayoutField& field) {
  skip_elements(field, take_count(field));
}

Value Wire::take_text() {
  const auto size = take<std::uint32_t>();
  const std::byte* const from = take_bytes(size, 1);
  if (from == nullptr) return {};
  const std::string_view text(reinterpret_cast<const char*>(from), size);
  return is_aligned_ && text.ends_with('\0') ? text.substr(0, size - 1) : text;  // CDR ends it with a zero
}

Value Wire::take_fixed_text(const LayoutField& field) {
  const std::uint64_t size = field.arity == FieldArity::rest ? left() : field.count;
  const std::byte* const from = take_bytes(size, 1);
  if (from == nullptr) return {};
  const std::string_view text(reinterpret_cast<const char*>(from), static_cast<std::size_t>(size));
  return field.arity == FieldArity::rest ? text : text.substr(0, text.find('\0'));
}

Value Wire::take_time(bool is_signed) {
  const auto first = take<std::uint32_t>();
  const auto nanoseconds = take<std::uint32_t>();
  const std::int64_t seconds = is_signed ? static_cast<std::int32_t>(first) : std::int64_t{first};
  // A duration of ROS 1 has a sign on both; elsewhere nanoseconds go up alone.
  const bool both_signed = is_signed && !is_aligned_;
  const std::int64_t rest = both_signed ? static_cast<std::int32_t>(nanoseconds) : std::int64_t{nanoseconds};
  if (!is_good_) return {};
  return seconds * kNanosecondsPerSecond + rest;
}

Value Wire::take_plain_number(FieldType type) {
  switch (type) {
    case FieldType::boolean:
      return std::uint64_t{take<std::uint8_t>() != 0};
    case FieldType::int8:
      return std::int64_t{take<std::int8_t>()};
    case FieldType::uint8:
    case FieldType::character:
      return std::uint64_t{take<std::uint8_t>()};
    case FieldType::int16:
      return std::int64_t{take<std::int16_t>()};
    case FieldType::uint16:
      return std::uint64_t{take<std::uint16_t>()};
    case FieldType::int32:
      return std::int64_t{take<std::int32_t>()};
    case FieldType::uint32:
      return std::uint64_t{take<std::uint32_t>()};
    case FieldType::int64:
      return take<std::int64_t>();
    case FieldType::uint64:
      return take<std::uint64_t>();
    case FieldType::float32:
      return double{take<float>()};
    case FieldType::float64:
      return take<double>();
    default:
      return fail();
  }
}

Value Wire::take_number(const LayoutField& field) {
  const std::byte* const before = at_;
  Value value = part_of(take_plain_number(field.type), field);
  if (!is_good_) return {};
  if (field.keeps_place) at_ = before;
  if (field.scale != 1.0) return *number_of(value) * field.scale;
  return value;
}

Value Wire::take_value(const LayoutField& field) {
  if (!is_good_) return {};
  if (is_text_array(field)) return take_fixed_text(field);
  switch (field.type) {
    case FieldType::string:
      return take_text();
    case FieldType::time:
      return take_time(false);
    case FieldType::duration:
      return take_time(true);
    case FieldType::structure:
      return layout_->structures()[field.structure].is_time ? take_time(true) : fail();
    case FieldType::wide_string:
      return fail();
    default:
      return take_number(field);
  }
}

}  // namespace trundle::logs
