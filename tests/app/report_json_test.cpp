// docs/report-json.md names every key of the report's data, and none that is not there.
#include <algorithm>
#include <map>
#include <set>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "trundle/io/file.hpp"

#include "app/process.hpp"
#include "app/sample.hpp"
#include "scale.hpp"

namespace trundle::test {
using namespace pipeline;
namespace {

using Json = nlohmann::json;

const std::filesystem::path kSource = TRUNDLE_SOURCE_DIR;

/// The keys of the tables under "## report" and "## results...", as paths, with their types.
std::map<std::string, std::string> documented_keys() {
  std::map<std::string, std::string> keys;
  std::istringstream page(read_file(kSource / "docs/report-json.md"));
  std::string prefix = "-";
  for (std::string line; std::getline(page, line);) {
    if (line.starts_with("## ")) {
      const std::string title = line.substr(3);
      prefix = title == "report" ? "" : title.starts_with("results[]") ? title + "." : "-";
    }
    if (prefix == "-" || !line.starts_with("| `")) continue;
    const std::size_t end = line.find(" | ", 2);
    const std::string type = line.substr(end + 3, line.find(" | ", end + 3) - end - 3);
    for (std::size_t at = line.find('`'); at < end; at = line.find('`', at + 1)) {
      const std::size_t close = line.find('`', at + 1);
      keys[prefix + line.substr(at + 1, close - at - 1)] = type;
      at = close;
    }
  }
  return keys;
}

bool is_whole(const std::string& type) {
  return std::ranges::any_of(std::array{"document", "column", "ellipse", "place"},
                             [&](const char* whole) { return type.starts_with(whole); });
}

void collect(const Json& value, const std::string& path, const std::map<std::string, std::string>& documented,
             std::set<std::string>& found) {
  if (const auto known = documented.find(path); known != documented.end() && is_whole(known->second)) return;
  if (value.is_array())
    for (const Json& element : value) collect(element, path + "[]", documented, found);
  if (!value.is_object()) return;
  for (const auto& [key, member] : value.items()) {
    const std::string below = path.empty() ? key : path + "." + key;
    found.insert(below);
    collect(member, below, documented, found);
  }
}

TEST(ReportJson, TheDocumentationNamesEveryKeyAndNoOther) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const Sample sample;
  const std::string demo = (kSource / "data/demo").string();
  const Outcome run =
      run_program(sample.folder(), {"run", demo + "/slip", "--robot", demo + "/robot.toml", "--calibrate-on",
                                    demo + "/session_01", "--learn", demo + "/session_01/tour", "--filter",
                                    "fastslam2", "-o", "d", "--quiet"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const Outcome grown =
      run_program(sample.folder(), {"slam", demo + "/session_01/tour", "--robot", demo + "/robot.toml",
                                    "--window", "30", "-o", "g", "--quiet"});
  ASSERT_EQ(grown.exit_code, 0) << grown.err;
  const Outcome report = run_program(sample.folder(), {"report", "d", "g", "-o", "r.json"});
  ASSERT_EQ(report.exit_code, 0) << report.err;

  const auto documented = documented_keys();
  std::set<std::string> found, named;
  collect(Json::parse(read_file(sample.folder() / "r.json")), "", documented, found);
  for (const auto& [key, type] : documented) named.insert(key);
  EXPECT_THAT(found, testing::ContainerEq(named));
}

}  // namespace
}  // namespace trundle::test
