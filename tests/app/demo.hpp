#pragma once

#include <filesystem>
#include <string>

namespace trundle::test {

/// The sample that the repository brings along: its folder and its nominal robot. In each source its own:
/// clang 14 would make an inline one after what is made of it.
const std::filesystem::path kDemo = std::filesystem::path(TRUNDLE_SOURCE_DIR) / "data/demo";
const std::string kDemoRobot = (kDemo / "robot.toml").string();

}  // namespace trundle::test
