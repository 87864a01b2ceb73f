#include "app/sample.hpp"

#include <cmath>
#include <cstdlib>
#include <numbers>
#include <string>

#include <fmt/format.h>

#include "trundle/geometry/pose2.hpp"
#include "trundle/io/file.hpp"

namespace trundle::test {
using namespace pipeline;
namespace {

constexpr double kLeftDiameter = 0.101;  // true values; nominal: 0.1, 0.1, 0.2
constexpr double kRightDiameter = 0.099;
constexpr double kTrack = 0.205;
constexpr double kTicks = 10000.0;

constexpr const char* kSampleRobot = R"(name = "sample"
[[wheel]]
name = "left"
y_m = 0.1
diameter_m = 0.1
ticks_per_revolution = 10000
[[wheel]]
name = "right"
y_m = -0.1
diameter_m = 0.1
ticks_per_revolution = 10000
)";

constexpr const char* kScenario = R"(name = "sample"
robot = "nominal.toml"
[truth]
track_m = 0.205
[truth.wheel.left]
diameter_m = 0.101
[truth.wheel.right]
diameter_m = 0.099
[reference]
rate_hz = 20
[[run]]
[[run.path]]
drive = "square"
side_m = 1.0
)";

constexpr const char* kSlippery = R"(name = "slippery"
robot = "with_gyro.toml"
steering = "truth"
[[run]]
[[run.path]]
drive = "pause"
duration_s = 2
[[run.path]]
drive = "straight"
length_m = 4
[[run.slip]]
wheel = "left"
start_s = 8
duration_s = 0.8
factor = 1.6
)";

// What `trundle simulate` writes for a robot with diameters of 0.1003 m and 0.0997 m and a track of 0.205 m.
constexpr const char* kSheet = R"(# side_m = 2
turn,x_m,y_m,heading_deg,leg_m
cw,0.108033,0.096414,-6.199694,1.998836
cw,0.099889,0.069220,-4.923197,2.000087
cw,0.089419,0.072420,-4.797898,2.000254
ccw,-0.325163,0.487111,-22.385992,1.999489
ccw,-0.329740,0.476954,-22.297304,2.000125
ccw,-0.345931,0.484182,-22.518853,1.999797
)";

// On the first side of the square: two landmarks ahead of it, one to the left.
constexpr const char* kSightings = R"(time_s,landmark,range_m,bearing_rad
0.5,a,2.75,0.0
0.5,"b, left",1.03,1.816
1.0,a,2.5,0.001
1.0,"b, left",1.0,1.571
1.02,c,1.5,-0.5
1.5,a,2.25,-0.001
1.5,"b, left",1.03,1.326
1.5,c,1.27,-0.6
)";

/// Drives the true robot and notes what its encoders and a perfect reference say.
struct Run {
  std::string wheels = "time_s,left_ticks,right_ticks\n";
  std::string reference = "time_s,x_m,y_m,heading_rad\n";
  Pose2 pose;
  double left_m = 0.0;
  double right_m = 0.0;
  int step = 0;

  void note() {
    const double time_s = 0.05 * step;
    wheels += fmt::format("{:.2f},{},{}\n", time_s,
                          std::lround(left_m / (std::numbers::pi * kLeftDiameter) * kTicks),
                          std::lround(right_m / (std::numbers::pi * kRightDiameter) * kTicks));
    reference += fmt::format("{:.2f},{:.9f},{:.9f},{:.9f}\n", time_s, pose.x, pose.y, pose.heading);
  }
  void move(double forward_m, double turn_rad) {
    left_m += forward_m - turn_rad * kTrack / 2.0;
    right_m += forward_m + turn_rad * kTrack / 2.0;
    pose = pose * exp(Twist2{forward_m, 0.0, turn_rad});
    ++step;
    note();
  }
};

Run square(double turn_sign) {
  Run run;
  run.note();
  for (int side = 0; side < 4; ++side) {
    for (int i = 0; i < 40; ++i) run.move(0.025, 0.0);
    for (int i = 0; i < 30; ++i) run.move(0.0, turn_sign * std::numbers::pi / 60.0);
  }
  return run;
}

constexpr std::string_view kPods = R"(name = "pods"
[[wheel]]
name = "ahead"
direction_deg = 0.0
kind = "omni"
diameter_m = 0.05
ticks_per_revolution = 2048
[[wheel]]
name = "across"
direction_deg = 90.0
kind = "omni"
diameter_m = 0.05
ticks_per_revolution = 2048
[gyro]
)";

/// An L of 1 m by the pods, of which one was mounted 0.1 rad wrong.
void write_l_run(const std::filesystem::path& folder) {
  std::string wheels = "time_s,ahead_m,across_m\n";
  std::string gyro = "time_s,yaw_rate_rad_s\n";
  for (int i = 0; i <= 100; ++i) {
    wheels += fmt::format("{:.1f},{},{}\n", 0.1 * i, 0.02 * std::min(i, 50), 0.02 * std::max(i - 50, 0));
    gyro += fmt::format("{:.1f},0\n", 0.1 * i);
  }
  write_file(folder / "wheels.csv", wheels);
  write_file(folder / "gyro.csv", gyro);
  write_file(folder / "recording.toml", fmt::format("[reference]\nend_x_m = 1.0\nend_y_m = {}\n",
                                                    (1.0 - std::sin(0.1)) / std::cos(0.1)));
}

std::string first_lines(std::string_view text, int count) {
  std::size_t end = 0;
  for (int i = 0; i < count; ++i) end = text.find('\n', end) + 1;
  return std::string(text.substr(0, end));
}

void write_run(const std::filesystem::path& folder, const Run& run) {
  write_file(folder / "wheels.csv", run.wheels);
  write_file(folder / "reference.csv", run.reference);
}

std::filesystem::path fresh_folder() {
  std::string name = (std::filesystem::temp_directory_path() / "trundle_app_XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder: " + name);
  return name;
}

}  // namespace

Sample::Sample() : folder_(fresh_folder()) {
  write_file(folder_ / "nominal.toml", kSampleRobot);
  write_file(folder_ / "scenario.toml", kScenario);
  write_file(folder_ / "with_gyro.toml", std::string(kSampleRobot) + "[gyro]\n");
  write_file(folder_ / "slippery.toml", kSlippery);
  write_file(folder_ / "sheet.csv", kSheet);
  write_file(folder_ / "sighted.toml", std::string(kSampleRobot) + "[landmark_sensor]\n");
  write_run(folder_ / "cw", square(-1.0));
  write_run(folder_ / "ccw", square(1.0));
  write_file(folder_ / "blind/wheels.csv", square(1.0).wheels);
  write_file(folder_ / "pods.toml", kPods);
  write_l_run(folder_ / "l_run");
  write_file(folder_ / "seen/wheels.csv", square(1.0).wheels);
  write_file(folder_ / "seen/sightings.csv", kSightings);
  write_file(folder_ / "seen_half/wheels.csv", first_lines(square(1.0).wheels, 29));
  write_file(folder_ / "seen_half/sightings.csv", first_lines(kSightings, 6));
  write_file(folder_ / "map.csv", "landmark,x_m,y_m\na,3,0\n\"b, left\",0.5,1\nc,2.1,-0.7\n");
  write_file(folder_ / "other_map.csv", "landmark,x_m,y_m\nd,3,0\ne,0.5,1\n");
  write_file(folder_ / "twice.csv", "landmark,x_m,y_m\na,3,0\na,0.5,1\n");
  write_file(folder_ / "unnamed/wheels.csv", square(1.0).wheels);
  write_file(folder_ / "unnamed/sightings.csv", "time_s,landmark,range_m,bearing_rad\n1,,2,0.1\n");
  write_file(folder_ / "later.csv", "time_s,x_m,y_m,heading_rad\n1000,0,0,0\n1001,1,0,0\n");
  std::filesystem::create_directory(folder_ / "empty");
}

Sample::~Sample() {
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

std::map<std::string, std::string> files_below(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  if (!std::filesystem::exists(folder)) return files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    if (entry.is_regular_file())
      files[entry.path().lexically_relative(folder).generic_string()] = read_file(entry.path());
  return files;
}

}  // namespace trundle::test
