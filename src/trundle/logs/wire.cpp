#include "trundle/logs/detail/wire.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>

#include <fmt/format.h>

#include "trundle/logs/field_reader.hpp"

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

/// IEEE 754's binary16.
double half_of(std::uint16_t bits) {
  constexpr unsigned kFraction = 10, kExponentMask = 31;  // 10 bits of fraction, 5 of exponent
  constexpr int kBias = 15;                               // 2^4 − 1
  const unsigned fraction = bits & ((1U << kFraction) - 1), exponent = bits >> kFraction & kExponentMask;
  const double sign = (bits & 0x8000U) != 0 ? -1.0 : 1.0;
  if (exponent == kExponentMask)
    return fraction != 0 ? std::numeric_limits<double>::quiet_NaN()
                         : sign * std::numeric_limits<double>::infinity();
  const unsigned significand = exponent == 0 ? fraction : fraction + (1U << kFraction);
  const int power = static_cast<int>(std::max(exponent, 1U)) - kBias - static_cast<int>(kFraction);
  return sign * std::ldexp(static_cast<double>(significand), power);
}

/// What the first two bytes of a message in CDR say: [OMG DDS-XTypes 1.3, 7.6.3.1.2] and, where numbers stand
/// twice, as drafts of it and some writers have them. Of each kind the odd number is the little-endian one.
struct Encapsulation {
  std::uint8_t number;  ///< of the big-endian one
  std::string_view name;
  std::size_t most_alignment = sizeof(double);
  bool is_delimited = false;       ///< the outermost structure is appendable
  bool is_parameter_list = false;  ///< fields by numbers, in any order
};
constexpr std::array kEncapsulations = {
    Encapsulation{0x00, "CDR"},
    Encapsulation{0x02, "PL_CDR", sizeof(double), false, true},
    Encapsulation{0x06, "CDR2", sizeof(float)},
    Encapsulation{0x08, "D_CDR2", sizeof(float), true},
    Encapsulation{0x0a, "PL_CDR2", sizeof(float), true, true},
    Encapsulation{0x10, "CDR2", sizeof(float)},
    Encapsulation{0x12, "PL_CDR2", sizeof(float), true, true},
    Encapsulation{0x14, "D_CDR2", sizeof(float), true},
};
constexpr std::size_t kCdrHeader = 4;  // two bytes of options follow

/// Null: the message is too short, or of no known kind.
const Encapsulation* encapsulation_of(std::span<const std::byte> bytes) {
  if (bytes.size() < kCdrHeader || bytes[0] != std::byte{0}) return nullptr;
  const auto number = static_cast<std::uint8_t>(std::to_integer<unsigned>(bytes[1]) & ~1U);
  const auto found = std::ranges::find(kEncapsulations, number, &Encapsulation::number);
  return found == kEncapsulations.end() ? nullptr : &*found;
}

}  // namespace

std::string fault_of_encapsulation(Encoding encoding, std::span<const std::byte> bytes) {
  if (encoding != Encoding::cdr || bytes.size() < kCdrHeader) return {};
  const Encapsulation* const kind = encapsulation_of(bytes);
  const unsigned number = std::to_integer<unsigned>(bytes[0]) << 8U | std::to_integer<unsigned>(bytes[1]);
  if (kind == nullptr) return fmt::format("their encapsulation 0x{:04x} is none of CDR's", number);
  if (!kind->is_parameter_list) return {};
  return fmt::format("they are parameter lists ({}, encapsulation 0x{:04x}), which are not read", kind->name,
                     number);
}

Wire::Wire(const Layout& layout, Encoding encoding, std::span<const std::byte> bytes)
    : layout_(&layout), at_(bytes.data()), end_(bytes.data() + bytes.size()) {
  if (encoding == Encoding::json || encoding == Encoding::unknown) is_good_ = false;
  if (encoding == Encoding::cdr) take_header(bytes);
  origin_ = at_;
}

void Wire::take_header(std::span<const std::byte> bytes) {
  const Encapsulation* const kind = encapsulation_of(bytes);
  if (kind == nullptr || kind->is_parameter_list) {
    is_good_ = false;
    return;
  }
  is_cdr_ = true;
  most_alignment_ = kind->most_alignment;
  is_version_2_ = kind->most_alignment < sizeof(double);
  delimits_unspecified_ = kind->is_delimited;
  is_big_endian_ = (bytes[1] & std::byte{1}) == std::byte{0};
  at_ += kCdrHeader;
}

const std::byte* Wire::enter(const LayoutStructure& structure) {
  const bool is_delimited =
      is_version_2_ && (structure.extensibility == Extensibility::appendable ||
                        (structure.extensibility == Extensibility::unspecified && delimits_unspecified_));
  if (!is_delimited) return nullptr;
  const auto size = take<std::uint32_t>();
  if (!is_good_ || size > left()) {
    is_good_ = false;
    return nullptr;
  }
  const std::byte* const outer_end = end_;
  end_ = at_ + size;
  return outer_end;
}

void Wire::leave(const std::byte* outer_end) {
  if (outer_end == nullptr) return;
  at_ = end_;
  end_ = outer_end;
}

const std::byte* Wire::take_bytes(std::uint64_t count, std::size_t alignment) {
  if (!is_good_) return nullptr;
  const auto offset = static_cast<std::size_t>(at_ - origin_);
  const std::size_t unit = std::min(alignment, most_alignment_);  // a power of two
  const std::size_t padding = (unit - offset % unit) % unit;
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
  const bool is_of_numbers = field.type != FieldType::structure && field.type != FieldType::string;
  if (is_version_2_ && field.arity != FieldArity::one && !is_of_numbers)
    take<std::uint32_t>();  // bytes of all
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
  for (; count > 0 && is_good_; --count) {
    const std::byte* const outer_end = enter(structure);
    if (outer_end == nullptr)
      for (const LayoutField& field : structure.fields) skip_field(field);
    leave(outer_end);
  }
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
  return is_cdr_ && text.ends_with('\0') ? text.substr(0, size - 1) : text;  // CDR ends it with a zero
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
  const bool both_signed = is_signed && !is_cdr_;
  const std::int64_t rest = both_signed ? static_cast<std::int32_t>(nanoseconds) : std::int64_t{nanoseconds};
  if (!is_good_) return {};
  return seconds * kNanosecondsPerSecond + rest;
}

Value Wire::take_time_structure(const LayoutStructure& structure) {
  if (!structure.is_time) return fail();
  const std::byte* const outer_end = enter(structure);
  Value time = take_time(true);
  leave(outer_end);
  return time;
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
    case FieldType::float16:
      return half_of(take<std::uint16_t>());
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
      return take_time_structure(layout_->structures()[field.structure]);
    case FieldType::wide_string:
      return fail();
    default:
      return take_number(field);
  }
}

}  // namespace trundle::logs
