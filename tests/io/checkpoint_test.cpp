#include "trundle/io/checkpoint.hpp"

#include <array>
#include <deque>
#include <limits>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "trundle/io/archive.hpp"
#include "trundle/io/error.hpp"
#include "trundle/io/file.hpp"

namespace trundle::io {
namespace {

enum class Colour : std::uint8_t { red, blue };

struct Part {
  double weight = 0.0;
  std::string name = {};

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.weight, self.name);
  }
  bool operator==(const Part&) const = default;
};

struct Whole {
  std::vector<Part> parts = {};
  std::deque<int> numbers = {};
  std::map<std::int64_t, std::vector<float>> by_key = {};
  std::optional<Part> spare = {};
  std::array<double, 3> fixed = {};
  std::pair<bool, Colour> pair = {};

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.parts, self.numbers, self.by_key, self.spare, self.fixed, self.pair);
  }
  bool operator==(const Whole&) const = default;
};

Whole some_whole() {
  return {{{1.5, "a"}, {-0.0, ""}, {std::numeric_limits<double>::denorm_min(), "\n\0x"}},
          {3, -1},
          {{-7, {1.0F, 2.0F}}, {9, {}}},
          Part{2.0, "spare"},
          {0.1, 0.2, 0.3},
          {true, Colour::blue}};
}

TEST(Archive, WhatIsWrittenIsRead) {
  Whole read;
  resume_state(read, state_of(some_whole()));
  EXPECT_EQ(read, some_whole());
  EXPECT_EQ(state_of(read), state_of(some_whole()));
}

TEST(Archive, BytesThatAreNoStateAreRefused) {
  const std::string state = state_of(some_whole());
  for (std::size_t length = 0; length < state.size(); ++length) {
    Whole read;
    EXPECT_THROW(resume_state(read, state.substr(0, length)), DamagedState) << length;
  }
  Whole read;
  EXPECT_THROW(resume_state(read, state + "x"), DamagedState);
  std::vector<Part> parts;
  EXPECT_THROW(resume_state(parts, std::string(8, '\xff')), DamagedState);  // 2^64 − 1 parts
}

/// As much of Eigen as the archive looks at.
struct SmallVector {
  static constexpr int RowsAtCompileTime = -1, ColsAtCompileTime = 1, MaxRowsAtCompileTime = 2,
                       MaxColsAtCompileTime = 1;
  std::ptrdiff_t rows() const { return size; }
  std::ptrdiff_t cols() const { return 1; }
  double* data() { return values; }
  const double* data() const { return values; }
  const SmallVector& derived() const { return *this; }
  void resize(std::ptrdiff_t rows, std::ptrdiff_t columns) {
    ASSERT_TRUE(rows >= 0 && rows <= 2 && columns == 1) << rows << " x " << columns;
    size = rows;
  }

  std::ptrdiff_t size = 0;
  double values[2] = {};
};

// Nothing is written beyond what a matrix has room for.
TEST(Archive, MatricesOfSizesThatTheyCannotHaveAreRefused) {
  SmallVector read;
  for (const std::int64_t rows : {1, 2}) {
    resume_state(read, state_of(std::pair(rows, std::int64_t{1})) +
                           std::string(8 * static_cast<std::size_t>(rows), 'x'));
    EXPECT_EQ(read.size, rows);
  }
  for (const auto& [rows, columns] :
       {std::pair<std::int64_t, std::int64_t>{3, 1}, {2, 0}, {1, 2}, {100, 0}, {-1, 1}, {1, -1}})
    EXPECT_THROW(resume_state(read, state_of(std::pair(rows, columns)) + std::string(800, 'x')), DamagedState)
        << rows << " x " << columns;
}

class Checkpoint : public testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove(path_); }
  std::string refusal_of(std::string_view content) const {
    write_file(path_, content);
    try {
      read_checkpoint(path_, "slam");
    } catch (const InputError& error) {
      return error.what();
    }
    return "none";
  }
  std::filesystem::path path_ =
      std::filesystem::temp_directory_path() / fmt::format("trundle_checkpoint_{}", ::getpid());
};

TEST_F(Checkpoint, KeepsEveryByte) {
  const std::string state("a\0b\nc", 5);
  write_checkpoint(path_, "slam", state);
  EXPECT_EQ(read_checkpoint(path_, "slam"), state);
}

TEST_F(Checkpoint, ForeignAndDamagedFilesAreNamed) {
  write_checkpoint(path_, "slam", "the state");
  const std::string whole = read_file(path_);
  for (std::size_t length = 0; length < whole.size(); ++length)
    EXPECT_THAT(refusal_of(whole.substr(0, length)), testing::HasSubstr(path_.string())) << length;
  EXPECT_THAT(refusal_of(whole + "more"), testing::HasSubstr("damaged"));
  EXPECT_THAT(refusal_of("time_s,x_m\n1,2\n"), testing::HasSubstr("no checkpoint"));
  EXPECT_THAT(refusal_of("trundle checkpoint 1" + whole.substr(whole.find(' ', 19))),
              testing::HasSubstr("format 1"));
  write_checkpoint(path_, "odometry", "the state");
  EXPECT_THAT(refusal_of(read_file(path_)), testing::HasSubstr("'odometry'"));
}

}  // namespace
}  // namespace trundle::io
