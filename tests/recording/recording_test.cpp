#include "trundle/recording/recording.hpp"

#include <atomic>
#include <cmath>
#include <map>
#include <thread>

#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "trundle/io/error.hpp"

#include "recording/folder.hpp"

namespace trundle::recording {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

TEST(Recording, reads_every_native_stream) {
  const test::Folder folder;
  folder.write("wheels.csv", "right_ticks,time_s,left_ticks,battery\n10,0,20,12.5\n11,0.1,22,12.4\n");
  folder.write("gyro.csv", "time_s,yaw_rate_rad_s\n0,0.5\n0.1,\n");
  folder.write("commands.csv", "time_s,forward_m_s,yaw_rate_rad_s\n0,1,2\n");
  folder.write("velocity.csv", "time_s,forward_m_s,yaw_rate_rad_s\n0,3,4\n");
  folder.write("accel.csv", "time_s,x_m_s2,y_m_s2\n0,5,6\n");
  folder.write("sightings.csv", "time_s,landmark,range_m,bearing_rad\n0,oak,7,0.25\n0,,8,-0.5\n");
  folder.write("reference.csv", "time_s,x_m,y_m,heading_rad\n0,1,2,3\n0.1,,,\n");
  folder.write("relative.csv", "start_s,end_s,dx_m,dy_m,dheading_rad\n0,0.5,1,2,3\n");
  folder.write("landmarks.csv", "landmark,x_m,y_m\noak,1,2\n");
  const Recording recording = read_recording(folder.path());
  EXPECT_EQ(recording.name, "run");
  EXPECT_EQ(recording.session, "tour");
  ASSERT_THAT(recording.wheels.series, SizeIs(2));
  EXPECT_EQ(recording.wheels.series[0].wheel, "right");
  EXPECT_THAT(recording.wheels.series[1].value, ElementsAre(20, 22));
  EXPECT_THAT(recording.wheels.time_s, ElementsAre(0, 0.1));
  EXPECT_EQ(recording.gyro.yaw_rate_rad_s[0], 0.5);
  EXPECT_TRUE(std::isnan(recording.gyro.yaw_rate_rad_s[1]));
  EXPECT_THAT(recording.commands.yaw_rate_rad_s, ElementsAre(2));
  EXPECT_THAT(recording.velocity.forward_m_s, ElementsAre(3));
  EXPECT_THAT(recording.accel.y_m_s2, ElementsAre(6));
  ASSERT_THAT(recording.sightings, SizeIs(2));
  EXPECT_EQ(recording.sightings[0].landmark, "oak");
  EXPECT_EQ(recording.sightings[1].landmark, "");
  EXPECT_EQ(recording.sightings[1].bearing_rad, -0.5);
  EXPECT_THAT(recording.reference.time_s, SizeIs(2));
  ASSERT_THAT(recording.relative_motions, SizeIs(1));
  EXPECT_EQ(recording.relative_motions[0].end_s, 0.5);
  EXPECT_EQ(recording.relative_motions[0].motion.heading, 3);
  EXPECT_EQ(recording.landmarks[0].position, Vector2(1, 2));
  EXPECT_THAT(recording.inputs, SizeIs(9));
  EXPECT_EQ(recording.inputs[0].sha256, sha256_of(read_file(folder / "wheels.csv")));
}

// They have no end, or keep silent.
TEST(Recording, pipes_and_devices_are_no_files) {
  const test::Folder folder;
  ASSERT_EQ(::mkfifo((folder / "wheels.csv").c_str(), 0600), 0);
  EXPECT_THROW(read_recording(folder.path()), InputError);
  std::filesystem::remove(folder / "wheels.csv");
  std::filesystem::create_symlink("/dev/zero", folder / "wheels.csv");
  EXPECT_THROW(read_recording(folder.path()), InputError);
}

// A log that grows or is cut meanwhile: the hash is that of the rows, and no page of a mapped file is
// missing.
TEST(Recording, of_a_log_that_is_being_written_is_hashed_as_it_was_read) {
  const test::Folder folder;
  std::string text = "time_s,a_ticks\n";
  std::map<std::string, std::size_t> rows_of;  // by the hash of each state
  std::vector<std::string> states;
  for (std::size_t row = 1; row <= 40; ++row) {
    text += fmt::format("{},{}\n", row, 1000 * row);
    rows_of[sha256_of(text)] = row;
    states.push_back(text);
  }
  folder.write("wheels.csv", text);
  std::atomic<bool> is_over = false;
  std::thread logger([&] {
    for (std::size_t k = 0; !is_over; k = (k + 7) % states.size())
      write_file(folder / "wheels.csv", states[k]);
  });
  for (int i = 0; i < 300; ++i) {
    const Recording recording = read_recording(folder.path());
    EXPECT_EQ(rows_of[recording.inputs[0].sha256], recording.wheels.time_s.size());
  }
  is_over = true;
  logger.join();
}

TEST(Recording, prefers_ticks_to_radians_to_metres_to_rates) {
  const test::Folder folder;
  folder.write("wheels.csv", "time_s,a_rad_s,a_m,a_ticks,b_m,b_rad_s,c_rad_s,d_m,d_rad\n0,1,2,3,4,5,6,7,8\n");
  const Recording recording = read_recording(folder.path());
  ASSERT_THAT(recording.wheels.series, SizeIs(4));
  EXPECT_EQ(recording.wheels.series[0].unit, WheelUnit::ticks);
  EXPECT_EQ(recording.wheels.series[1].unit, WheelUnit::metres);
  EXPECT_EQ(recording.wheels.series[2].unit, WheelUnit::rate);
  EXPECT_EQ(recording.wheels.series[3].unit, WheelUnit::radians);
  EXPECT_THAT(recording.wheels.series[3].value, ElementsAre(8));
}

TEST(Recording, a_reference_may_lack_columns) {
  const test::Folder folder;
  folder.write("reference.csv", "time_s,heading_rad\n0,3.1\n0.1,-3.1\n");
  const Recording recording = read_recording(folder.path());
  EXPECT_TRUE(std::isnan(recording.reference.x_m[1]));
  EXPECT_NEAR(recording.reference.heading_rad[1], 2.0 * kPi - 3.1, 1e-12);
}

TEST(Recording, a_heading_may_be_a_quaternion) {
  test::Folder folder;
  folder.write("wheels.csv", "time_s,left_m\n0,0\n1,1\n");
  const auto heading_of = [&](const std::string& table) {
    folder.write("reference.csv", table);
    return read_recording(folder.path()).reference.heading_rad.at(1);
  };
  const double yaw = 0.7, roll = 0.2;
  EXPECT_NEAR(heading_of(fmt::format("time_s,x_m,y_m,qz,qw\n0,0,0,0,1\n1,0,0,{},{}\n", std::sin(0.5 * yaw),
                                     std::cos(0.5 * yaw))),
              yaw, 1e-12);
  // yaw after roll: (cos y/2 + k sin y/2)(cos r/2 + i sin r/2), at any length
  EXPECT_NEAR(heading_of(fmt::format("time_s,x_m,y_m,qx,qy,qz,qw\n0,0,0,0,0,0,1\n1,0,0,{},{},{},{}\n",
                                     2.0 * std::cos(0.5 * yaw) * std::sin(0.5 * roll),
                                     2.0 * std::sin(0.5 * yaw) * std::sin(0.5 * roll),
                                     2.0 * std::sin(0.5 * yaw) * std::cos(0.5 * roll),
                                     2.0 * std::cos(0.5 * yaw) * std::cos(0.5 * roll))),
              yaw, 1e-12);
  EXPECT_EQ(heading_of("time_s,heading_rad,qz,qw\n0,0,0,1\n1,0.25,0,1\n"), 0.25);
  EXPECT_TRUE(std::isnan(heading_of("time_s,x_m,y_m,qz\n0,0,0,0\n1,1,0,0\n")));
}

TEST(Recording, a_gap_of_the_reference_adds_no_turn_and_continuous_headings_keep_their_bits) {
  const test::Folder folder;
  folder.write("reference.csv",
               "time_s,x_m,y_m,heading_rad\n0,0,0,6.1\n0.1,0,0,6.4\n0.2,0,0,9.1\n5,0,0,-3\n5.1,0,0,0.1\n");
  const ReferenceStream reference = read_recording(folder.path()).reference;
  EXPECT_EQ(reference.heading_rad[1], 6.4);
  EXPECT_EQ(reference.heading_rad[2], 9.1);
  EXPECT_LT(std::abs(reference.heading_rad[3] - 9.1), kPi);
}

Recording with_every_stream() {
  Recording recording;
  recording.name = "run";
  recording.session = "a \"quoted\" \\ day";
  recording.wheels.time_s = {0.1, 0.2, 1.0 / 3.0};
  recording.wheels.series = {{"left", WheelUnit::ticks, {1, kNotMeasured, 3}},
                             {"right", WheelUnit::metres, {0.1, 1.0 / 7.0, 0.3}},
                             {"front", WheelUnit::rate, {1e-300, -2, 3}},
                             {"rear", WheelUnit::radians, {1, 2, 3}}};
  recording.gyro = {{0.0, 0.01}, {1.0 / 3.0, kNotMeasured}};
  recording.velocity = {{1.0}, {0.1}, {0.2}};
  recording.commands = {{2.0}, {0.3}, {0.4}};
  recording.accel = {{3.0}, {0.5}, {9.80665}};
  recording.sightings = {{0.5, "7", 1.5, -0.1}, {0.5, "", 2.5, 0.1}, {0.75, "big, tree", 2.5, 0.1}};
  recording.reference = {{0.0, 0.1}, {1.0, kNotMeasured}, {2.0, 3.0}, {kPi, 7.0 / 3.0}};
  recording.relative_motions = {{0.0, 0.5, {1.0, 2.0, 1.0 / 3.0}}};
  recording.landmarks = {{"7", {1.0 / 3.0, 2.0}}, {"big, tree", {3.0, 4.0}}};
  recording.partial.closed = Measured{0.0, 0.003};
  recording.partial.closed_heading = Measured{0.0, 1.0 / 300.0};
  recording.partial.distance_m = Measured{1.0 / 3.0, 0.001};
  recording.partial.turns = Measured{-5.0, 0.01};
  recording.partial.end_x_m = Measured{0.5, 0.002};
  recording.partial.end_y_m = Measured{-0.25, 0.002};
  recording.partial.end_heading_rad = Measured{2.0 / 3.0, 1.0 / 90.0};
  return recording;
}

void expect_same(const std::vector<double>& a, const std::vector<double>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i)
    EXPECT_TRUE(a[i] == b[i] || (std::isnan(a[i]) && std::isnan(b[i]))) << i;
}

void expect_same(const std::optional<Measured>& a, const std::optional<Measured>& b) {
  ASSERT_EQ(a.has_value(), b.has_value());
  if (!a) return;
  EXPECT_EQ(a->value, b->value);
  EXPECT_EQ(a->sigma, b->sigma);
}

TEST(Recording, reads_back_what_it_wrote_to_the_last_bit) {
  const test::Folder folder;
  const Recording written = with_every_stream();
  write_recording(written, folder.path());
  const Recording read = read_recording(folder.path());
  EXPECT_EQ(read.name, written.name);
  EXPECT_EQ(read.session, written.session);
  expect_same(read.wheels.time_s, written.wheels.time_s);
  ASSERT_EQ(read.wheels.series.size(), written.wheels.series.size());
  for (std::size_t i = 0; i < read.wheels.series.size(); ++i) {
    EXPECT_EQ(read.wheels.series[i].wheel, written.wheels.series[i].wheel);
    EXPECT_EQ(read.wheels.series[i].unit, written.wheels.series[i].unit);
    expect_same(read.wheels.series[i].value, written.wheels.series[i].value);
  }
  expect_same(read.gyro.time_s, written.gyro.time_s);
  expect_same(read.gyro.yaw_rate_rad_s, written.gyro.yaw_rate_rad_s);
  expect_same(read.velocity.forward_m_s, written.velocity.forward_m_s);
  expect_same(read.commands.yaw_rate_rad_s, written.commands.yaw_rate_rad_s);
  expect_same(read.accel.y_m_s2, written.accel.y_m_s2);
  ASSERT_EQ(read.sightings.size(), written.sightings.size());
  for (std::size_t i = 0; i < read.sightings.size(); ++i) {
    EXPECT_EQ(read.sightings[i].landmark, written.sightings[i].landmark);
    EXPECT_EQ(read.sightings[i].range_m, written.sightings[i].range_m);
    EXPECT_EQ(read.sightings[i].bearing_rad, written.sightings[i].bearing_rad);
  }
  expect_same(read.reference.x_m, written.reference.x_m);
  expect_same(read.reference.heading_rad, written.reference.heading_rad);
  ASSERT_EQ(read.relative_motions.size(), 1);
  EXPECT_EQ(read.relative_motions[0].motion.heading, 1.0 / 3.0);
  ASSERT_EQ(read.landmarks.size(), written.landmarks.size());
  EXPECT_EQ(read.landmarks[1].name, "big, tree");
  EXPECT_EQ(read.landmarks[0].position, written.landmarks[0].position);
  for (const auto member :
       {&PartialReference::closed, &PartialReference::closed_heading, &PartialReference::distance_m,
        &PartialReference::turns, &PartialReference::end_x_m, &PartialReference::end_y_m,
        &PartialReference::end_heading_rad})
    expect_same(read.partial.*member, written.partial.*member);
}

TEST(Recording, without_streams_has_no_reference_and_an_empty_partial_one) {
  EXPECT_FALSE(Recording{}.has_reference());
  EXPECT_TRUE(PartialReference{}.empty());
  EXPECT_TRUE(with_every_stream().has_reference());
}

TEST(RecordingsBelow, finds_the_folder_itself_or_all_inside_in_order) {
  const test::Folder folder;
  const std::filesystem::path session = folder.path().parent_path();
  folder.write("wheels.csv", "time_s,l_m\n0,0\n1,1\n");
  folder.write("../later/recording.toml",
               "[wheels]\nfile = \"../run/wheels.csv\"\ncolumns = { time_s = 1, l_m = 2 }\n");
  folder.write("../notes/readme.txt", "nothing\n");
  EXPECT_THAT(recordings_below(folder.path()), ElementsAre(folder.path()));
  EXPECT_THAT(recordings_below(session), ElementsAre(session / "later", session / "run"));
  EXPECT_THAT(recordings_below(session.parent_path()), SizeIs(2));
  EXPECT_EQ(read_recording(session / "later").session, "tour");
}

TEST(RecordingsBelow, says_of_a_file_that_it_is_empty_or_no_log) {
  const test::Folder folder;
  const auto fault_of = [](const std::filesystem::path& path) {
    try {
      (void)recordings_below(path);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(fault_of(folder.write("empty.bag", "")),
              HasSubstr("empty.bag: is empty; expected the folder of a "));
  EXPECT_THAT(fault_of(folder.write("short.bag", "#RO")),
              HasSubstr("is neither a folder nor a log of a known format"));
  EXPECT_THROW((void)read_recording(folder / "empty.bag"), InputError);
}

TEST(RecordingsBelow, looks_once_into_a_folder_that_links_lead_to) {
  const test::Folder folder;
  const std::filesystem::path session = folder.path().parent_path();
  folder.write("wheels.csv", "time_s,l_m\n0,0\n1,1\n");
  std::filesystem::create_directory_symlink(session, session / "again");  // without end
  std::filesystem::create_directory_symlink(folder.path(), session / "a_link");
  EXPECT_THAT(recordings_below(session), ElementsAre(session / "run"));
  const test::Folder other;
  std::filesystem::create_directory_symlink(folder.path(), other / "link");  // the only way there
  EXPECT_THAT(recordings_below(other.path()), ElementsAre(other / "link"));
}

}  // namespace
}  // namespace trundle::recording
