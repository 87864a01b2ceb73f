#include "trundle/recording/landmark_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/io/error.hpp"

#include "recording/folder.hpp"

namespace trundle::recording {
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

class LandmarkCovariance : public testing::Test {
 protected:
  std::vector<MapLandmark> map_ = {{"a,b", {1.0, 2.0}, Vector2(4.0, 1.0).asDiagonal()},
                                   {"c", {3.0, 0.0}, Vector2(2.0, 3.0).asDiagonal()}};
  Eigen::MatrixXd together() const {
    Eigen::MatrixXd covariance = Eigen::Vector4d(4.0, 1.0, 2.0, 3.0).asDiagonal();
    covariance(0, 2) = covariance(2, 0) = 1.5;
    return covariance;
  }
  Eigen::MatrixXd read(const std::string& text) const {
    const test::Folder folder;
    folder.write("map_covariance.csv", text);
    return read_landmark_covariance(covariance_file_of(folder.path() / "map.csv"), map_);
  }
};

TEST_F(LandmarkCovariance, ReadsWhatWasWritten) {
  EXPECT_EQ(read("# a head\n" + landmark_covariance_csv({"a,b", "c"}, together())), together());
}

TEST_F(LandmarkCovariance, IsRefusedWhereItIsOfAnotherMapOrNone) {
  const auto refused = [&](const std::vector<std::string>& names, const Eigen::MatrixXd& covariance) {
    EXPECT_THROW(read(landmark_covariance_csv(names, covariance)), InputError);
  };
  refused({"a,b", "d"}, together());
  refused({"c", "a,b"}, together());
  refused({"a,b"}, together().topLeftCorner(2, 2));
  Eigen::MatrixXd wrong = together();
  wrong(2, 2) = 2.5;
  refused({"a,b", "c"}, wrong);
  wrong = together();
  wrong(0, 2) = 1.0;
  refused({"a,b", "c"}, wrong);
  wrong(0, 2) = wrong(2, 0) = 3.0;
  refused({"a,b", "c"}, wrong);
  EXPECT_THROW(read("landmark,axis\n"), InputError);
  EXPECT_THROW(read("nothing"), InputError);
}

TEST(LandmarkFile, ReadsTheMapOfMrclam) {
  const test::Folder folder;
  const auto map = read_landmark_map(
      folder.write("Landmark_Groundtruth.dat",
                   "# Subject x y x-sd y-sd\n 6   1.1  -5.3 \t 0.001 0.002\n 7 -0.5 2 0.001 0.001\n"));
  ASSERT_EQ(map.size(), 2U);
  EXPECT_EQ(map[0].name, "6");
  EXPECT_EQ(map[0].position, Vector2(1.1, -5.3));
}

}  // namespace
}  // namespace trundle::recording
