#include "trundle/io/file.hpp"

#include <fstream>
#include <functional>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "trundle/io/error.hpp"
#include "trundle/io/pieces.hpp"

namespace trundle::io {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// A folder of its own for each test, gone afterwards.
class FileTest : public testing::Test {
 protected:
  FileTest() { fs::create_directories(folder_); }
  ~FileTest() override { fs::remove_all(folder_); }

  std::size_t files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }

  fs::path folder_ =
      fs::path(testing::TempDir()) / (fmt::format("trundle_{}_", ::getpid()) +
                                      testing::UnitTest::GetInstance()->current_test_info()->name());
};

std::string message_of(const std::function<void()>& act) {
  try {
    act();
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST_F(FileTest, what_was_written_is_read) {
  const std::string content("a\0b\r\n\xff", 6);
  write_file(folder_ / "x", content);
  EXPECT_EQ(read_file(folder_ / "x"), content);
  write_file(folder_ / "x", "");
  EXPECT_EQ(read_file(folder_ / "x"), "");
}

TEST_F(FileTest, is_written_in_pieces_or_stays_as_it_was) {
  write_file(folder_ / "x", [](const TakeText& take) {
    take("a");
    take("");
    take("bc");
  });
  EXPECT_EQ(read_file(folder_ / "x"), "abc");
  EXPECT_EQ(message_of([&] {
              write_file(folder_ / "x", [](const TakeText& take) {
                take("new");
                throw InputError("row 7", "is missing", "a row");
              });
            }),
            InputError("row 7", "is missing", "a row").what());
  EXPECT_EQ(read_file(folder_ / "x"), "abc");
  EXPECT_EQ(files(), 1);
}

TEST_F(FileTest, is_hashed_whole_however_long_it_is) {
  const std::string content(200'001, 'x');  // several pieces
  write_file(folder_ / "x", content);
  EXPECT_EQ(input_file(folder_ / "x").sha256, sha256_of(content));
  EXPECT_EQ(sha256_of("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

TEST_F(FileTest, what_is_no_file_is_not_replaced_by_one) {
  ASSERT_EQ(::mkfifo((folder_ / "pipe").c_str(), 0600), 0);
  fs::create_symlink("pipe", folder_ / "link");
  for (const char* name : {"pipe", "link"}) {
    EXPECT_THAT(message_of([&] { write_file(folder_ / name, "x"); }), HasSubstr("is no file"));
    EXPECT_TRUE(fs::is_fifo(folder_ / name));
  }
  EXPECT_THAT(message_of([&] { write_file(folder_, "x"); }), HasSubstr("is a folder"));
}

TEST_F(FileTest, what_is_no_file_or_fails_while_it_is_read_is_refused) {
  ASSERT_EQ(::mkfifo((folder_ / "pipe").c_str(), 0600), 0);
  EXPECT_THAT(message_of([&] { read_file(folder_ / "pipe"); }), HasSubstr("is no file"));
  EXPECT_THAT(message_of([&] { read_file("/dev/zero"); }), HasSubstr("is no file"));
  // Its first page is not mapped: reading there is an I/O error.
  EXPECT_THAT(message_of([&] { read_file("/proc/self/mem"); }), HasSubstr("Input/output error"));
}

TEST_F(FileTest, outputs_are_apart_from_inputs_by_whatever_name) {
  write_file(folder_ / "in", "x");
  write_file(folder_ / "out", "x");
  fs::create_symlink("in", folder_ / "soft");
  fs::create_hard_link(folder_ / "in", folder_ / "hard");
  const std::vector<InputFile> inputs = {input_file(folder_ / "in"), {.path = "", .sha256 = ""}};
  require_apart(inputs, {folder_ / "out", folder_ / "new", ""});
  for (const char* name : {"in", "./in", "soft", "hard"})
    EXPECT_THAT(message_of([&] {
                  require_apart(inputs, {folder_ / "out", folder_ / name});
                }),
                HasSubstr("is an input, which would be lost"));
}

TEST_F(FileTest, writing_makes_folders_and_leaves_no_temporary_file) {
  write_file(folder_ / "a" / "b" / "x", "1");
  write_file(folder_ / "y", "2");
  write_file(folder_ / "y", "3");
  EXPECT_EQ(read_file(folder_ / "a" / "b" / "x"), "1");
  EXPECT_EQ(files(), 2U);
}

TEST_F(FileTest, a_reader_keeps_the_old_file_while_a_new_one_takes_its_name) {
  write_file(folder_ / "x", "old");
  std::ifstream reader(folder_ / "x");
  write_file(folder_ / "x", "new");
  std::string text;
  reader >> text;
  EXPECT_EQ(text, "old");  // replaced, not overwritten
  EXPECT_EQ(read_file(folder_ / "x"), "new");
}

TEST_F(FileTest, a_failed_write_leaves_what_was_there) {
  fs::create_directories(folder_ / "taken" / "inside");
  const std::string message = message_of([&] { write_file(folder_ / "taken", "x"); });
  EXPECT_THAT(message, HasSubstr("taken: "));
  EXPECT_THAT(message, HasSubstr("expected a place that can be written"));
  EXPECT_TRUE(fs::exists(folder_ / "taken" / "inside"));
  EXPECT_EQ(files(), 1U);
}

TEST_F(FileTest, no_file_can_be_written_below_a_file) {
  write_file(folder_ / "x", "1");
  EXPECT_THAT(message_of([&] { write_file(folder_ / "x" / "y", "2"); }), HasSubstr("x/y: Not a directory"));
  EXPECT_EQ(read_file(folder_ / "x"), "1");
}

TEST_F(FileTest, a_missing_file_and_a_folder_are_named) {
  EXPECT_THAT(message_of([&] { read_file(folder_ / "none"); }), HasSubstr("none: No such file"));
  EXPECT_THAT(message_of([&] { read_file(folder_); }), HasSubstr("is a folder; expected a file"));
}

TEST_F(FileTest, input_file_has_path_and_digest) {
  write_file(folder_ / "x", "abc");
  const InputFile file = input_file(folder_ / "x");
  EXPECT_EQ(file.path, (folder_ / "x").string());
  EXPECT_EQ(file.sha256, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

// FIPS 180-4 and NIST's example values.
TEST(Sha256, agrees_with_published_values) {
  EXPECT_EQ(sha256_of(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256_of("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(sha256_of(std::string(1000000, 'a')),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

}  // namespace
}  // namespace trundle::io
