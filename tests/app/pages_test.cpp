// What the pages for newcomers show is what the commands in them print.
#include <filesystem>
#include <fstream>
#include <sstream>
#include <utility>

#include <gtest/gtest.h>

#include "trundle/io/file.hpp"

#include "app/driven_logs.hpp"
#include "app/process.hpp"
#include "app/sample.hpp"
#include "real_data.hpp"

namespace trundle::test {
namespace {

/// A command of a page, and the lines that it shows of what is printed.
struct Shown {
  Arguments arguments;
  std::vector<std::string> lines;
};

std::vector<std::string> words_in(const std::string& line) {
  std::istringstream in(line);
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back(word);
  return words;
}

/// "$ trundle ..." in blocks of shell, and what follows until the next or the end of the block.
std::vector<Shown> shown_in(const std::string& page) {
  std::vector<Shown> all;
  std::istringstream in(read_file(std::filesystem::path(TRUNDLE_SOURCE_DIR) / "docs" / page));
  bool is_block = false, is_command = false;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("```")) {
      is_block = line == "```sh";
      is_command = false;
    } else if (is_block && line.starts_with("$ trundle ")) {
      const std::vector<std::string> words = words_in(line);
      all.push_back({{words.begin() + 2, words.end()}, {}});
      is_command = true;
    } else if (is_block && is_command && !line.empty() && line.find("...") == std::string::npos) {
      all.back().lines.push_back(line);
    }
  }
  return all;
}

/// A page leaves out the columns' padding where it leaves out lines.
std::string without_padding(const std::string& text) {
  std::string narrow;
  for (const char c : text)
    if (c != ' ' || !narrow.ends_with(' ')) narrow += c;
  return narrow;
}

/// Runs the commands of a page. Lines may be left out on it; those that it has are there, in their order.
/// `fill_in` does what the page says is done after a command.
template <class FillIn>
void expect_page_holds(const Sample& sample, const std::string& page, FillIn fill_in) {
  const std::vector<Shown> all = shown_in(page);
  ASSERT_GE(all.size(), 2U) << page;
  for (const Shown& shown : all) {
    const Outcome outcome = run_program(sample.folder(), shown.arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    const std::string printed = without_padding(outcome.out);
    std::size_t from = 0;
    for (const std::string& line : shown.lines) {
      const std::string wanted = without_padding(line);
      const std::size_t at = printed.find(wanted + "\n", from);
      EXPECT_NE(at, std::string::npos) << page << ": " << line << "\nis not in what "
                                       << shown.arguments.front() << " prints, or not there:\n"
                                       << outcome.out;
      if (at != std::string::npos) from = at + wanted.size();
    }
    fill_in(shown.arguments.front());
  }
}

void put_log(const Sample& sample, const std::string& name, const std::string& bytes) {
  std::ofstream(sample.folder() / name, std::ios::binary) << bytes;
}

TEST(Pages, Ros1) {
  TRUNDLE_NEEDS_REAL_DATA("logs/gsid_square.bag");
  const Sample sample;
  put_log(sample, "gsid_square.bag", read_file(real_data() / "logs/gsid_square.bag"));
  expect_page_holds(sample, "ros1.md", [](const std::string&) {});
}

TEST(Pages, Ros2) {
  TRUNDLE_NEEDS_REAL_DATA("logs/dan_drive_square.db3");
  const Sample sample;
  put_log(sample, "dan_drive_square.db3", read_file(real_data() / "logs/dan_drive_square.db3"));
  expect_page_holds(sample, "ros2.md", [](const std::string&) {});
}

TEST(Pages, Ardupilot) {
  const Sample sample;
  put_log(sample, "rover.bin", dataflash());
  expect_page_holds(sample, "ardupilot.md", [](const std::string&) {});
}

/// The two numbers of the robot that the page names are written where the draft asks for them.
TEST(Pages, Frc) {
  const Sample sample;
  put_log(sample, "match.wpilog", wpilog());
  expect_page_holds(sample, "frc.md", [&](const std::string& command) {
    if (command != "init") return;
    const std::filesystem::path robot = sample.folder() / "mine/robot.toml";
    std::istringstream in(read_file(robot));
    std::string filled, side = "0.25";
    for (std::string line; std::getline(in, line);) {
      if (line.starts_with("# diameter_m")) line = "diameter_m = 0.1524";
      if (line.starts_with("# y_m")) line = "y_m = " + std::exchange(side, "-0.25");
      filled += line + "\n";
    }
    std::ofstream(robot) << filled;
  });
}

}  // namespace
}  // namespace trundle::test
