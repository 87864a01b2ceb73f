// The recordings in data/ are what their scenarios make, byte for byte.
#include <algorithm>
#include <filesystem>
#include <sstream>

#include <gtest/gtest.h>

#include "trundle/io/file.hpp"
#include "trundle/simulation/scenario_file.hpp"

namespace trundle::simulation {
namespace {

namespace fs = std::filesystem;

const fs::path kData = fs::path(TRUNDLE_SOURCE_DIR) / "data";

/// Without the lines that name version and inputs.
std::string without_comments(const std::string& text) {
  std::istringstream lines(text);
  std::string kept;
  for (std::string line; std::getline(lines, line);)
    if (!line.starts_with('#') || line.starts_with("# side_m")) kept += line + '\n';
  return kept;
}

std::vector<fs::path> files_below(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) files.push_back(fs::relative(entry.path(), folder));
  std::ranges::sort(files);
  return files;
}

struct Sample {
  const char* name;
  const char* scenario;
  const char* folder;
};

class Samples : public testing::TestWithParam<Sample> {};

TEST_P(Samples, AreWhatTheirScenariosMake) {
  const fs::path out = fs::path(testing::TempDir()) / "trundle_sample" / GetParam().name;
  fs::remove_all(out);
  write_plan(read_plan(kData / GetParam().scenario), out, {});
  const fs::path sample = kData / GetParam().folder;
  const auto made = files_below(out);
  for (const fs::path& file : made) {
    if (file == "robot.toml") continue;  // written only where there is none
    EXPECT_EQ(without_comments(read_file(out / file)), without_comments(read_file(sample / file))) << file;
  }
  for (const fs::path& file : files_below(sample)) {
    if (file.extension() != ".csv" || *file.begin() == "slip") continue;
    EXPECT_TRUE(std::ranges::find(made, file) != made.end()) << file << " is made by no scenario";
  }
  fs::remove_all(out);
}

INSTANTIATE_TEST_SUITE_P(Data, Samples,
                         testing::Values(Sample{"demo", "demo/scenario.toml", "demo"},
                                         Sample{"slip", "demo/slip.toml", "demo/slip"},
                                         Sample{"umbmark", "umbmark/scenario.toml", "umbmark"}),
                         [](const auto& test) { return std::string(test.param.name); });

TEST(SampleFolder, IsSmall) {
  std::uintmax_t bytes = 0;
  for (const fs::path& file : files_below(kData)) bytes += fs::file_size(kData / file);
  EXPECT_LT(bytes, 2'000'000u);
}

}  // namespace
}  // namespace trundle::simulation
