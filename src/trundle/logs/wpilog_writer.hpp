#pragma once

#include <cstdint>
#include <string_view>

#include "trundle/io/pieces.hpp"
#include "trundle/logs/detail/byte_writer.hpp"

namespace trundle::logs {

/// A WPILOG 1.0 file, WPILib's data log, written as its values come.
/// https://github.com/wpilibsuite/allwpilib/blob/main/wpiutil/doc/datalog.adoc
class WpilogWriter {
 public:
  /// `take` has the bytes as they come, and must outlive it. `extra_header`: what the file says of itself.
  WpilogWriter(const TakeText& take, std::string_view extra_header);

  /// An entry for values of a type: "double[]", "struct:Pose2d". From `time_us` on.
  [[nodiscard]] std::uint32_t start(std::string_view name, std::string_view type, std::int64_t time_us);
  /// A value, packed as its type is, with its time in microseconds, from 0 on.
  void add(std::uint32_t entry, std::int64_t time_us, std::string_view value);
  /// Hands on what is left.
  void finish();

 private:
  const TakeText& take_;
  ByteWriter pending_;
  std::uint32_t entries_ = 0;
};

}  // namespace trundle::logs
