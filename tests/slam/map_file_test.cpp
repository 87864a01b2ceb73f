#include "trundle/slam/map_file.hpp"

#include <gtest/gtest.h>

#include "trundle/recording/landmark_file.hpp"

#include "recording/folder.hpp"

namespace trundle::slam {
namespace {

TEST(MapFile, ReadsBackToTheLastBit) {
  const test::Folder folder;
  std::vector<MappedLandmark> map{{.id = 1, .position = {1.0 / 3.0, -2.0e-7}, .sightings = 4},
                                  {.id = 0, .position = {5.0, 0.1}, .sightings = 1}};
  map[0].covariance << 0.1, 0.01, 0.01, 0.3;
  const std::vector<MapLandmark> read =
      read_landmark_map(folder.write("landmarks.csv", to_csv(map, {"post", "door, left"})));
  ASSERT_EQ(read.size(), 2U);
  EXPECT_EQ(read[0].name, "door, left");
  EXPECT_EQ(read[0].position, map[0].position);
  EXPECT_EQ(read[0].covariance, map[0].covariance);
  EXPECT_EQ(read[1].name, "post");
}

TEST(MapFile, NumbersThatAreNamesAlreadyAreNotGivenAgain) {
  EXPECT_EQ(landmark_names({"2", "tree"}, 4), (std::vector<std::string>{"2", "tree", "1", "3", "4"}));
  EXPECT_EQ(landmark_names({}, kUnknownLandmark), std::vector<std::string>{});
}

TEST(MapFile, CallsLandmarksWithoutNamesByNumber) {
  const std::string text = to_csv({{.id = 2}, {.id = 0}}, {"1"});
  EXPECT_NE(text.find("\n3,"), std::string::npos) << text;
  EXPECT_NE(text.find("\n1,"), std::string::npos) << text;
}

}  // namespace
}  // namespace trundle::slam
