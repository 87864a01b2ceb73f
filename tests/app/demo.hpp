#pragma once

#include <filesystem>
#include <string>

namespace trundle::test {

/// The sample that the repository brings along: its folder and its nominal robot.
inline const std::filesystem::path kDemo = std::filesystem::path(TRUNDLE_SOURCE_DIR) / "data/demo";
inline const std::string kDemoRobot = (kDemo / "robot.toml").string();

}  // namespace trundle::test
