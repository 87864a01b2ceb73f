#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "trundle/io/file.hpp"
#include "trundle/io/pieces.hpp"
#include "trundle/io/sha256.hpp"
#include "trundle/recording/csv/reader.hpp"

namespace trundle::recording {

/// A file with a table, of which only the head stays in memory: rows are numbers before the next ones are
/// read.
class CsvFile {
 public:
  /// Throws InputError as FilePieces does, and where the text is not UTF-8.
  CsvFile(const std::filesystem::path& path, const CsvFormat& format);

  /// What a CsvTable is to be made of.
  [[nodiscard]] const std::string& head() const { return head_; }
  /// What follows it, once. The file must outlive it.
  [[nodiscard]] CsvRest rest();
  /// The very bytes that were read, after the last of them: a log may still grow.
  [[nodiscard]] InputFile input();

 private:
  std::string_view next();

  std::filesystem::path path_;
  FilePieces pieces_;
  Sha256 sha_;
  std::string head_;
};

}  // namespace trundle::recording
