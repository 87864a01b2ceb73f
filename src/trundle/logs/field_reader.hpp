#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "trundle/logs/log.hpp"

namespace trundle::logs {

/// A path that leads to no field of a layout: what it names, and what is there.
class UnknownField : public std::runtime_error {
 public:
  UnknownField(const std::string& fact, std::string expected)
      : std::runtime_error(fact), expectation(std::move(expected)) {}
  std::string expectation;
};

/// A path through a layout, compiled: it reads one field of each message.
///
///   angular_velocity.z                       of nested structures
///   values[3]                                an element, from 0
///   position[name=left_wheel]                the element at which the array of texts beside it, `name`, says
///   so transforms[child_frame_id=base].transform.translation.x   the structure whose field says so; several:
///                                            [header.frame_id=odom,child_frame_id=base]
///   detections[].id                          of every element
///   header.stamp                             a time
///   log_time                                 when the message was recorded
class FieldReader {
 public:
  /// Throws UnknownField.
  FieldReader(const Layout& layout, Encoding encoding, std::string_view path);
  ~FieldReader();
  FieldReader(FieldReader&&) noexcept;
  FieldReader& operator=(FieldReader&&) noexcept;

  /// Nothing where the message has no such element, or ends before it.
  [[nodiscard]] Value read(const Message& message) const;
  /// Of a path with []: one for each element, in order. Otherwise the one.
  void read_all(const Message& message, std::vector<Value>& values) const;
  /// The path has [].
  [[nodiscard]] bool is_repeated() const;
  /// The field is a time or a duration: whole nanoseconds.
  [[nodiscard]] bool is_time() const;
  /// Whether it is a text.
  [[nodiscard]] bool is_text() const;
  /// The unit that the format names; empty: none.
  [[nodiscard]] const std::string& unit() const;

 private:
  struct Program;
  std::unique_ptr<Program> program_;
};

/// Why a message's own header says that it cannot be decoded, whatever its layout; empty: it can.
[[nodiscard]] std::string fault_of_encapsulation(Encoding encoding, std::span<const std::byte> bytes);

/// Nothing where the path leads to no field.
[[nodiscard]] std::optional<FieldReader> reader_if_known(const Layout& layout, Encoding encoding,
                                                         std::string_view path);

/// Every field of a message in order, by its path: "position[2]". False where the message ends before its
/// layout does.
bool visit(const Layout& layout, Encoding encoding, std::span<const std::byte> bytes,
           const std::function<void(std::string_view path, const Value&)>& visitor);

}  // namespace trundle::logs
