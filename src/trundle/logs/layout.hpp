#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "trundle/namespaces.hpp"

namespace trundle::logs {

/// A definition that cannot be understood: what is wrong with it, in one line.
class BadDefinition : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What one element of a field is.
enum class FieldType : std::uint8_t {
  boolean,
  int8,
  uint8,
  int16,
  uint16,
  int32,
  uint32,
  int64,
  uint64,
  float16,
  float32,
  float64,
  string,       ///< after its length
  wide_string,  ///< of UTF-16 or wider: implementations differ, so nothing behind it can be read
  character,    ///< text of a fixed length, ended by a zero byte where it is shorter: packed alone
  time,         ///< ROS 1: seconds and nanoseconds, 32 bits each
  duration,     ///< likewise, signed
  structure,
};

enum class FieldArity : std::uint8_t {
  one,
  fixed,    ///< `count` elements
  dynamic,  ///< after their number
  rest,     ///< as many as the message has bytes for: packed alone
};

struct LayoutField {
  std::string name;
  FieldType type = FieldType::uint8;
  FieldArity arity = FieldArity::one;
  std::uint32_t structure = 0;  ///< whose index, of FieldType::structure
  std::uint32_t count = 1;      ///< of FieldArity::fixed; of bounded dynamic arrays the bound is not kept
  double scale = 1.0;           ///< number = what is stored · scale [unit]
  std::string unit = {};        ///< where the format names it
  std::uint8_t bits = 0;        ///< of a bit-field of the type; 0: the whole
  std::uint8_t first_bit = 0;   ///< its lowest
  bool keeps_place = false;     ///< the next field begins where this one does: bit-fields of one integer
  bool is_padding = false;      ///< no field of its own
};

struct LayoutConstant {
  std::string name;
  std::string value;  ///< as it is written
};

/// Whether a structure may have more fields in a later version of its definition, as IDL says it. Of one that
/// may, XCDR2 writes the length before the fields.
enum class Extensibility : std::uint8_t { unspecified, final, appendable };

struct LayoutStructure {
  std::string name;  ///< "geometry_msgs/Vector3"
  std::vector<LayoutField> fields;
  std::vector<LayoutConstant> constants = {};
  /// One time of seconds and nanoseconds, as ROS 2 has it: a field of this structure is a value.
  bool is_time = false;
  Extensibility extensibility = Extensibility::unspecified;
};

/// What the bytes of a message mean: structures of fields, the outermost last.
class Layout {
 public:
  /// Throws BadDefinition where a field names a structure at or behind its own (so none contains itself), or
  /// structures nest deeper than `deepest`.
  explicit Layout(std::vector<LayoutStructure> structures, std::size_t deepest = kDeepest);

  /// Nested deeper, nothing that a robot records is.
  static constexpr std::size_t kDeepest = 32;

  [[nodiscard]] const std::vector<LayoutStructure>& structures() const { return structures_; }
  [[nodiscard]] const LayoutStructure& root() const { return structures_.back(); }
  /// Least bytes that one needs: 0 only of those without any field.
  [[nodiscard]] std::uint64_t least_size(std::uint32_t structure) const { return least_sizes_[structure]; }
  /// The paths of all fields, "header.stamp", "name[]", in order: for those who choose.
  [[nodiscard]] std::vector<std::string> paths() const;

 private:
  std::vector<LayoutStructure> structures_;
  std::vector<std::uint64_t> least_sizes_;
};

/// A field of a message: nothing where it is not there. Times and durations are whole nanoseconds; text is
/// that of the message, and lives as long.
using Value = std::variant<std::monostate, std::int64_t, std::uint64_t, double, std::string_view>;

/// The nearest double; nothing of text.
[[nodiscard]] std::optional<double> number_of(const Value& value);

}  // namespace trundle::logs
