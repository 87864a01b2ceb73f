// robot.toml. What was read and written reads back as the same text.
#include "trundle/chassis/robot.hpp"

#include "input.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace trundle;
  std::string written;
  fuzz::try_to(
      [&] { written = chassis::to_toml(chassis::parse_robot(fuzz::text_of(data, size), "robot.toml")); });
  if (!written.empty()) fuzz::require(chassis::to_toml(chassis::parse_robot(written, "again")) == written);
  return 0;
}
