// trajectory.tum. What was read can be written and read again.
#include "trundle/recording/trajectory_file.hpp"

#include "input.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace trundle;
  static const fuzz::Folder folder;
  const auto file = folder.write("trajectory.tum", fuzz::text_of(data, size));
  geometry::Trajectory read;
  fuzz::try_to([&] { read = recording::read_trajectory(file); });
  if (!read.poses.empty())
    (void)recording::read_trajectory(folder.write("again.tum", recording::to_tum(read)));
  return 0;
}
