#include "trundle/recording/landmark_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/io/error.hpp"

#include "recording/folder.hpp"

namespace trundle {
namespace {

std::vector<MapLandmark> read(const std::string& text) {
  const test::Folder folder;
  folder.write("map.csv", text);
  return read_landmark_map(folder.path() / "map.csv");
}

TEST(LandmarkFile, ReadsNamesPlacesAndCovariances) {
  const auto map =
      read("# a comment\nlandmark,x_m,y_m,var_xx,var_xy,var_yy,sightings\na,1,2,0.04,0.01,0.09,7\n");
  ASSERT_EQ(map.size(), 1U);
  EXPECT_EQ(map[0].name, "a");
  EXPECT_EQ(map[0].position, Vector2(1.0, 2.0));
  EXPECT_EQ(map[0].covariance, (Matrix2() << 0.04, 0.01, 0.01, 0.09).finished());
}

TEST(LandmarkFile, WithoutCovarianceLandmarksAreExact) {
  const auto map = read("y_m,landmark,x_m\n2,a,1\n-3,b,4\n");
  ASSERT_EQ(map.size(), 2U);
  EXPECT_EQ(map[1].position, Vector2(4.0, -3.0));
  EXPECT_EQ(map[1].covariance, Matrix2::Zero());
}

TEST(LandmarkFile, RefusesWhatIsNoMap) {
  for (const char* text :
       {"landmark,x_m,y_m\n", "landmark,x_m\na,1\n", "landmark,x_m,y_m\na,1,2\na,3,4\n",
        "landmark,x_m,y_m\n,1,2\n", "landmark,x_m,y_m\na,,2\n",
        "landmark,x_m,y_m,var_xx,var_xy,var_yy\na,1,2,-1,0,1\n",
        "landmark,x_m,y_m,var_xx,var_xy,var_yy\na,1,2,1,2,1\n", "landmark,x_m,y_m,var_xx\na,1,2,1\n"})
    EXPECT_THROW(read(text), InputError) << text;
}

}  // namespace
}  // namespace trundle
