// An MCAP file of a robot whose messages are 1 GB, compressed by zstd: written to the folder for temporary
// files, and read from its start to its end; and every field of its first 80 000 messages but scans, as a
// robot's gyro, wheels and odometry are read. Prints processor times, and the memory at its peak.
#include <array>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <map>
#include <span>

#include <fmt/core.h>
#include <sys/resource.h>
#include <unistd.h>

#include "trundle/io/pieces.hpp"
#include "trundle/logs/cdr_writer.hpp"
#include "trundle/logs/definitions.hpp"
#include "trundle/logs/field_reader.hpp"
#include "trundle/logs/log.hpp"
#include "trundle/logs/mcap_writer.hpp"
#include "trundle/statistics/random.hpp"

namespace {

namespace logs = trundle::logs;

constexpr double kBytes = 1e9;
constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::int64_t kStart_ns = 1'700'000'000 * kSecond_ns;
constexpr std::int64_t kStep_ns = kSecond_ns / 200;
constexpr int kRays = 720;
constexpr int kDecoded = 80'000;

/// Writes messages that a robot records, with the noise that compresses badly.
class Recorder {
 public:
  explicit Recorder(const trundle::io::TakeText& take)
      : file_(take, "log_bench"),
        imu_(file_.add_channel("/imu", "sensor_msgs/msg/Imu")),
        joints_(file_.add_channel("/joint_states", "sensor_msgs/msg/JointState")),
        odometry_(file_.add_channel("/odom", "nav_msgs/msg/Odometry")),
        scan_(file_.add_channel("/scan", "sensor_msgs/msg/LaserScan")) {}

  void step() {
    add_imu();
    if (count_ % 4 == 0) add_wheels();
    if (count_ % 10 == 0) add_scan();
    ++count_;
  }
  void finish() { file_.finish(); }
  double bytes() const { return bytes_; }

 private:
  std::int64_t time_ns() const { return kStart_ns + count_ * kStep_ns; }
  double time_s() const { return 1e-9 * static_cast<double>(count_ * kStep_ns); }
  double noise(double sigma) { return random_.normal(sigma); }

  void begin(std::string_view frame) {
    message_.clear();
    message_.put(static_cast<std::int32_t>(time_ns() / kSecond_ns));
    message_.put(static_cast<std::uint32_t>(time_ns() % kSecond_ns)).text(frame);
  }
  void put_zeros(int count) {
    for (int i = 0; i < count; ++i) message_.put(0.0);
  }
  void send(std::uint16_t channel) {
    file_.add(channel, time_ns(), message_.bytes());
    bytes_ += static_cast<double>(message_.bytes().size());
  }

  void add_imu() {
    begin("imu");
    put_zeros(3);
    message_.put(1.0);
    put_zeros(9);
    message_.put(noise(0.01)).put(noise(0.01)).put(0.3 * std::cos(0.3 * time_s()) + noise(0.002));
    put_zeros(9);
    message_.put(noise(0.1)).put(noise(0.1)).put(9.81 + noise(0.1));
    put_zeros(9);
    send(imu_);
  }

  void add_wheels() {
    const double apart = 3.0 * std::sin(0.3 * time_s()), way = 10.0 * time_s();
    begin("");
    message_.count(2).text("left_wheel").text("right_wheel");
    message_.count(2).put(way - apart).put(way + apart).count(2).put(10.0).put(10.0).count(0);
    send(joints_);
    begin("odom");
    message_.text("base_link");
    for (int i = 0; i < 7; ++i) message_.put(noise(1.0));
    put_zeros(36);
    for (int i = 0; i < 6; ++i) message_.put(noise(1.0));
    put_zeros(36);
    send(odometry_);
  }

  void add_scan() {
    begin("laser");
    for (const float number : {-3.14F, 3.14F, 0.0087F, 0.0F, 0.05F, 0.1F, 12.0F}) message_.put(number);
    message_.count(kRays);
    for (int i = 0; i < kRays; ++i)  // in millimetres
      message_.put(static_cast<float>(std::round(1e3 * (3.0 + std::sin(0.1 * i) + noise(0.01))) / 1e3));
    message_.count(kRays);
    for (int i = 0; i < kRays; ++i) message_.put(static_cast<float>(std::round(100.0 + noise(10.0))));
    send(scan_);
  }

  logs::McapWriter file_;
  std::uint16_t imu_, joints_, odometry_, scan_;
  trundle::statistics::Random random_{1};
  logs::CdrWriter message_;
  std::int64_t count_ = 0;
  double bytes_ = 0.0;
};

double processor_s() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

double peak_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return 1e-3 * static_cast<double>(usage.ru_maxrss);
}

/// Every field of so many messages, scans apart; how many fields there were.
std::int64_t decode(const std::filesystem::path& path, int count) {
  std::int64_t fields = 0;
  std::map<const logs::Channel*, logs::Layout> layouts;
  const auto log = logs::open_log(path);
  while (count > 0) {
    const auto message = log->next();
    if (!message) break;
    const logs::Channel& channel = *message->channel;
    if (channel.topic == "/scan") continue;
    auto layout = layouts.find(&channel);
    if (layout == layouts.end()) layout = layouts.emplace(&channel, logs::layout_of(channel)).first;
    logs::visit(layout->second, channel.encoding, message->bytes,
                [&](std::string_view, const logs::Value&) { ++fields; });
    --count;
  }
  return fields;
}

}  // namespace

int main() {
  const std::filesystem::path path =
      std::filesystem::temp_directory_path() / fmt::format("trundle_log_bench_{}.mcap", getpid());
  const double start_s = processor_s();
  {
    std::ofstream out(path, std::ios::binary);
    const trundle::io::TakeText take = [&](std::string_view bytes) {
      out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    };
    Recorder recorder(take);
    while (recorder.bytes() < kBytes) recorder.step();
    recorder.finish();
  }
  const double written_s = processor_s();
  double bytes = 0.0;
  const auto log = logs::open_log(path);
  while (const auto message = log->next()) bytes += static_cast<double>(message->bytes.size());
  const double read_s = processor_s();
  fmt::print(
      "log: {:.0f} MB of messages in {:.0f} MB; written in {:.2f} s, read in {:.2f} s: {:.0f} MB/s; "
      "{:.0f} MB of memory\n",
      1e-6 * bytes, 1e-6 * static_cast<double>(std::filesystem::file_size(path)), written_s - start_s,
      read_s - written_s, 1e-6 * bytes / (read_s - written_s), peak_mb());
  const double decode_s = processor_s();
  const std::int64_t fields = decode(path, kDecoded);
  fmt::print("log: {} fields of {} messages in {:.2f} s\n", fields, kDecoded, processor_s() - decode_s);
  std::filesystem::remove(path);
  return bytes >= kBytes ? 0 : 1;
}
