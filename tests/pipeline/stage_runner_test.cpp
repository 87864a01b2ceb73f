#include "trundle/pipeline/stage_runner.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/recording/trajectory_file.hpp"

#include "recording/folder.hpp"

namespace trundle::pipeline {
namespace {

using testing::ElementsAre;

/// Stages of a run that writes into a folder.
class Stages : public testing::Test {
 protected:
  Found<int> answer(const std::string& file, const std::string& content) const {
    return {.value = 42, .message = "found", .files = {{folder_ / file, content}}, .remarks = {"note: so"}};
  }

  static RunInputs into(const std::filesystem::path& folder) {
    RunInputs inputs;
    inputs.question.output = folder;
    return inputs;
  }

  test::Folder folder_;
  RunInputs inputs_ = into(folder_.path());
  RunRecord record_;
  OnProgress silent_;
  ResultFolder results_{folder_.path()};
  StageRunner stage_{inputs_, results_, record_, silent_};
};

TEST_F(Stages, GiveTheirValueAndWriteTheirFiles) {
  const auto result = stage_(StageKind::slip, [&] { return answer("slip.json", "{}"); });
  EXPECT_EQ(result.value, 42);
  EXPECT_FALSE(result.failure);
  EXPECT_EQ(read_file(results_.staged() / "slip.json"), "{}");
  ASSERT_EQ(record_.stages.size(), 1);
  EXPECT_EQ(record_.stages[0].status, StageStatus::done);
  EXPECT_THAT(record_.stages[0].outputs, ElementsAre("slip.json"));
  EXPECT_THAT(record_.stages[0].remarks, ElementsAre("note: so"));
}

TEST_F(Stages, ThatDoNotApplyAreNoFailure) {
  const auto result = stage_(StageKind::slam, [&]() -> Found<int> { throw NotApplicable{"nothing seen"}; });
  EXPECT_FALSE(result.value);
  EXPECT_FALSE(result.failure);
  EXPECT_EQ(record_.stages[0].status, StageStatus::skipped);
  EXPECT_EQ(record_.stages[0].message, "nothing seen");
}

TEST_F(Stages, ThatFailSayByWhatTheProgramExits) {
  const auto data = stage_(StageKind::odometry, [&]() -> Found<int> { throw CannotAnswer("no rows"); });
  const auto input =
      stage_(StageKind::slip, [&]() -> Found<int> { throw InputError("f.csv", "is bad", "good"); });
  ASSERT_TRUE(data.failure && input.failure);
  EXPECT_EQ(data.failure->kind, kCannotAnswer);
  EXPECT_EQ(input.failure->kind, kBadInput);
  EXPECT_EQ(record_.stages[0].message, "no rows");
  EXPECT_EQ(record_.stages[1].status, StageStatus::failed);
}

TEST_F(Stages, AreNotTriedWhereWhatTheyGoByWasMisread) {
  stage_.forbid({{Misread::reference, "d/reference.csv: degrees"}});
  bool called = false;
  const auto result = stage_(StageKind::evaluation, [&] {
    called = true;
    return answer("evaluation.json", "{}");
  });
  EXPECT_FALSE(called);
  ASSERT_TRUE(result.failure);
  EXPECT_EQ(result.failure->message, "not done: d/reference.csv: degrees");
  EXPECT_TRUE(stage_(StageKind::odometry, [&] { return answer("odometry.json", "{}"); }).value);
}

TEST_F(Stages, NameTheirFilesForThePage) {
  stage_(StageKind::odometry, [&] { return answer("odometry.json", "{}"); });
  stage_(StageKind::slam,
         [&] { return answer("slam/trajectory.csv", "# trundle 1\ntime_s,x_m,heading_rad\n"); });
  stage_(StageKind::calibration, [&] { return answer("calibrated.toml", ""); });
  stage_.add_copy(StageKind::slam, folder_ / "slam/trajectory.csv", folder_ / "trajectory.csv");
  std::vector<std::string> names;
  for (const ResultSource& source : stage_.sources())
    names.push_back(
        std::filesystem::path(source.file.path).lexically_relative(folder_.path()).generic_string());
  EXPECT_THAT(names, ElementsAre("odometry.json", "slam/trajectory.csv", "trajectory.csv"));
  EXPECT_THAT(stage_.sources()[1].made_by, ElementsAre("trundle 1"));
  EXPECT_EQ(stage_.sources()[1].name, "slam/trajectory");
  EXPECT_EQ(stage_.sources()[2].name, "trajectory");
  EXPECT_EQ(stage_.sources()[2].file.sha256, stage_.sources()[1].file.sha256);
  EXPECT_EQ(read_file(results_.staged() / "trajectory.csv"), "# trundle 1\ntime_s,x_m,heading_rad\n");
  EXPECT_THAT(record_.stages[1].outputs, ElementsAre("slam/trajectory.csv", "trajectory.csv"));
}

TEST_F(Stages, WriteAFileWhileItIsMade) {
  const auto rows = [](const TakeText& take) { take("time_s,x_m,heading_rad\n"), take("0,1,2\n"); };
  stage_(StageKind::odometry, [&]() -> Found<int> {
    return {.value = 1, .files = {stage_.write_now({folder_ / "odometry.csv", "# trundle 1\n", rows})}};
  });
  const std::string text = "# trundle 1\ntime_s,x_m,heading_rad\n0,1,2\n";
  EXPECT_EQ(read_file(results_.staged() / "odometry.csv"), text);
  EXPECT_THAT(record_.stages[0].outputs, ElementsAre("odometry.csv"));
  ASSERT_EQ(stage_.sources().size(), 1);
  EXPECT_EQ(stage_.sources()[0].file.sha256, sha256_of(text));
  EXPECT_THAT(stage_.sources()[0].made_by, ElementsAre("trundle 1"));
}

TEST_F(Stages, LeaveNoFileThatCouldNotBeMade) {
  const auto broken = [](const TakeText& take) {
    take("time_s,x_m\n0,1\n");
    throw InputError("robot.toml", "is bad", "good");
  };
  const auto no_number = [](const TakeText& take) { take("time_s,x_m\n0,nan\n"); };
  for (const auto& rest : {std::function<void(const TakeText&)>(broken), {no_number}}) {
    const auto result = stage_(StageKind::odometry, [&]() -> Found<int> {
      return {.value = 1, .files = {stage_.write_now({folder_ / "odometry.csv", "", rest})}};
    });
    EXPECT_TRUE(result.failure);
    EXPECT_FALSE(std::filesystem::exists(results_.staged() / "odometry.csv"));
  }
}

TEST_F(Stages, EndWhereTheDiskRefuses) {
  std::filesystem::create_directories(results_.staged() / "odometry.csv");
  EXPECT_THROW(stage_(StageKind::odometry,
                      [&]() -> Found<int> {
                        return {.value = 1, .files = {stage_.write_now({folder_ / "odometry.csv", "", {}})}};
                      }),
               CannotWrite);
}

TEST(Misread, MotionForbidsAllButThePage) {
  for (const StageKind stage : {StageKind::calibration, StageKind::odometry, StageKind::slip,
                                StageKind::localization, StageKind::slam, StageKind::evaluation})
    EXPECT_TRUE(forbids(Misread::motion, stage)) << name_of(stage);
  for (const Misread what : {Misread::motion, Misread::reference, Misread::other})
    EXPECT_FALSE(forbids(what, StageKind::report));
}

TEST(Misread, WiresMayBePutRightByACalibration) {
  EXPECT_FALSE(forbids(Misread::wires, StageKind::calibration));
  for (const StageKind stage : {StageKind::odometry, StageKind::slip, StageKind::localization,
                                StageKind::slam, StageKind::evaluation})
    EXPECT_TRUE(forbids(Misread::wires, stage)) << name_of(stage);
}

TEST_F(Stages, AreTriedWhereWhatWasMisreadIsPutRight) {
  stage_.forbid(
      {{Misread::wires, "d/wheels.csv: backwards"}, {Misread::reference, "d/reference.csv: degrees"}});
  stage_.permit(Misread::wires);
  EXPECT_TRUE(stage_(StageKind::odometry, [&] { return answer("o.json", "{}"); }).value);
  EXPECT_FALSE(stage_(StageKind::evaluation, [&] { return answer("e.json", "{}"); }).value);
}

TEST(Misread, ReferenceForbidsWhatComparesWithIt) {
  EXPECT_TRUE(forbids(Misread::reference, StageKind::calibration));
  EXPECT_TRUE(forbids(Misread::reference, StageKind::evaluation));
  EXPECT_FALSE(forbids(Misread::reference, StageKind::slam));
}

TEST(Misread, SightingsLeaveOdometryAndSlip) {
  EXPECT_FALSE(forbids(Misread::other, StageKind::odometry));
  EXPECT_FALSE(forbids(Misread::other, StageKind::slip));
  EXPECT_TRUE(forbids(Misread::other, StageKind::slam));
}

/// Equal stamps, headings that jump, covariances whose halves differ by rounding.
TEST(WrittenTrajectory, IsWhatItsFileGives) {
  Trajectory trajectory;
  for (const auto& [time_s, heading] :
       std::vector<std::pair<double, double>>{{0.1, 3.1}, {0.2, -3.1}, {0.2, -3.0}, {0.3, -2.9}}) {
    trajectory.poses.push_back({time_s, {1.0 / 3.0, -0.0, heading}});
    Matrix3 covariance = Matrix3::Identity() * 1e-4;
    covariance(0, 1) = 1.0 / 7e5;
    covariance(1, 0) = std::nextafter(covariance(0, 1), 1.0);
    trajectory.covariances.push_back(covariance);
  }
  const test::Folder folder;
  folder.write("trajectory.csv", to_csv(trajectory));
  const Trajectory read = read_trajectory(folder / "trajectory.csv"), written = as_written(trajectory);
  ASSERT_EQ(read.poses.size(), 3);
  ASSERT_EQ(written.poses.size(), 3);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(read.poses[i].time_s, written.poses[i].time_s);
    EXPECT_EQ(read.poses[i].pose.x, written.poses[i].pose.x);
    EXPECT_EQ(read.poses[i].pose.heading, written.poses[i].pose.heading);
  }
  EXPECT_EQ(read.covariances, written.covariances);
}

}  // namespace
}  // namespace trundle::pipeline
