#include "trundle/io/staging.hpp"

#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "trundle/io/error.hpp"
#include "trundle/io/file.hpp"

namespace trundle::io {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Pair;

/// Results in `out`, below a folder of its own for each test.
class Results : public testing::Test {
 protected:
  Results() {
    std::string name = (fs::path(testing::TempDir()) / "trundle_staging_XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
    above_ = fs::canonical(name);
    out_ = above_ / "out";
  }
  ~Results() override { fs::remove_all(above_); }

  std::map<std::string, std::string> files() const {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(above_))
      if (entry.is_regular_file())
        files[entry.path().lexically_relative(above_).generic_string()] = read_file(entry.path());
    return files;
  }
  /// A run that may write run.json, a.csv and slam/b.csv, and writes those that are given.
  void run(const std::map<std::string, std::string>& files) const {
    ResultFolder results(out_);
    for (const auto& [name, content] : files) results.write(out_ / name, content);
    results.commit({"run.json", "a.csv", "slam/b.csv"}, "run.json");
  }

  fs::path above_;
  fs::path out_;
};

TEST_F(Results, AppearAllAtOnce) {
  ResultFolder results(out_);
  results.write(out_ / "slam/b.csv", "b");
  EXPECT_FALSE(fs::exists(out_));
  results.commit({}, "run.json");
  EXPECT_THAT(files(), ElementsAre(Pair("out/slam/b.csv", "b")));
}

TEST_F(Results, TakeThePlaceOfThoseBeforeAndOfNothingElse) {
  run({{"run.json", "1"}, {"a.csv", "1"}, {"slam/b.csv", "1"}});
  write_file(out_ / "notes.txt", "mine");
  write_file(out_ / "slam/notes.txt", "mine");
  run({{"run.json", "2"}});
  EXPECT_THAT(files(), ElementsAre(Pair("out/notes.txt", "mine"), Pair("out/run.json", "2"),
                                   Pair("out/slam/notes.txt", "mine")));
}

TEST_F(Results, AreExchangedAsAWholeWithTheRightsOfTheFolder) {
  run({{"run.json", "1"}, {"a.csv", "1"}});
  fs::permissions(out_, fs::perms::owner_all);
  struct stat before {
  }, after{};
  ::stat(out_.c_str(), &before);
  run({{"run.json", "2"}});
  ::stat(out_.c_str(), &after);
  EXPECT_NE(before.st_ino, after.st_ino);
  EXPECT_EQ(before.st_mode, after.st_mode);
}

// A folder of the user, of whatever size, stays where it is: file by file.
TEST_F(Results, LeaveTheFoldersOfOthersAlone) {
  run({{"run.json", "1"}, {"a.csv", "1"}, {"slam/b.csv", "1"}});
  write_file(out_ / "mine/a.csv", "mine");
  run({{"run.json", "2"}});
  EXPECT_THAT(files(), ElementsAre(Pair("out/mine/a.csv", "mine"), Pair("out/run.json", "2")));
  EXPECT_FALSE(fs::exists(out_ / "slam"));
}

TEST_F(Results, GoIntoTheFolderInWhichTheProgramRuns) {
  run({{"run.json", "1"}, {"a.csv", "1"}});
  const fs::path before = fs::current_path();
  fs::current_path(out_);
  {
    ResultFolder results(".");
    results.write("./run.json", "2");
    results.commit({"run.json", "a.csv"}, "run.json");
  }
  EXPECT_TRUE(fs::exists("run.json"));
  fs::current_path(before);
  EXPECT_THAT(files(), ElementsAre(Pair("out/run.json", "2")));
}

TEST_F(Results, ThatAreNotCompleteLeaveWhatWasThere) {
  run({{"run.json", "1"}});
  { ResultFolder(out_).write(out_ / "run.json", "2"); }
  EXPECT_THAT(files(), ElementsAre(Pair("out/run.json", "1")));
  { ResultFolder(above_ / "new/deep").write(above_ / "new/deep/run.json", "2"); }
  EXPECT_FALSE(fs::exists(above_ / "new"));
}

TEST_F(Results, OfTwoRunsAtOnceAreRefused) {
  const ResultFolder first(out_);
  try {
    const ResultFolder second(out_);
    FAIL() << "two runs write one folder";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("out: is in use by another run"));
  }
}

TEST_F(Results, OfAKilledRunAreRemovedByTheNext) {
  write_file(above_ / ".out.trundle-new/a.csv", "half");
  write_file(above_ / ".other.trundle-new/a.csv", "half");
  write_file(above_ / ".x.csv.trundle-new", "half");
  run({{"run.json", "1"}});
  EXPECT_THAT(files(), ElementsAre(Pair("out/run.json", "1")));
}

TEST_F(Results, OfARunThatStillWritesStay) {
  const ResultFolder other(above_ / "other");
  other.write(above_ / "other/a.csv", "half");
  run({{"run.json", "1"}});
  EXPECT_TRUE(fs::exists(other.staged() / "a.csv"));
}

TEST_F(Results, ThatAreNoNumbersAreNotWritten) {
  ResultFolder results(out_);
  EXPECT_THROW(results.write(out_ / "a.csv", "x_m\nnan\n"), CannotAnswer);
  EXPECT_THROW(write_file(above_ / "a.csv", "x_m\ninf\n"), CannotAnswer);
  EXPECT_THROW(write_file(above_ / "new/er/a.csv", "x_m\ninf\n"), CannotAnswer);
  EXPECT_FALSE(fs::exists(above_ / "new"));
  EXPECT_THAT(files(), testing::IsEmpty());
}

TEST_F(Results, OfSeveralFilesAreAllWrittenOrNone) {
  write_file(above_ / "a", "old");
  fs::create_directory(above_ / "b");
  EXPECT_THROW(write_set({{above_ / "a", "new"}, {above_ / "b", "new"}}), InputError);
  EXPECT_THAT(files(), ElementsAre(Pair("a", "old")));
}

}  // namespace
}  // namespace trundle::io
