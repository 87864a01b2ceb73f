// rosbag_time BAG: reads the bytes of every message of a ROS 1 bag by librosbag_storage, as
// tools/rosbag_time.sh compiles it. Prints their number and processor time.
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <vector>

#include <ros/serialization.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  const std::clock_t start = std::clock();
  std::size_t messages = 0, bytes = 0;
  std::vector<std::uint8_t> buffer;
  rosbag::Bag bag(argv[1]);
  for (const rosbag::MessageInstance& message : rosbag::View(bag)) {
    buffer.resize(message.size());
    ros::serialization::OStream stream(buffer.data(), static_cast<std::uint32_t>(buffer.size()));
    message.write(stream);
    ++messages;
    bytes += buffer.size();
  }
  std::printf("librosbag_storage: %zu messages, %zu bytes in %.3f s\n", messages, bytes,
              static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
}
