#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "trundle/namespaces.hpp"

namespace trundle::io {

/// The last look at a file while it is written.
class FiniteNumbers {
 public:
  explicit FiniteNumbers(const std::filesystem::path& path);

  /// Of the text that follows, a piece of whole lines: throws CannotAnswer, which names file, line and column
  /// or key, where a number of a .csv, .tum or .toml is none, or a variance is negative. JSON has null for
  /// what is not known.
  void require_in(std::string_view lines);

 private:
  struct Column {
    std::string name;
    bool is_text = false;
    bool is_variance = false;
  };

  void require_row(std::string_view line);
  void require_values(std::string_view line) const;
  void read_header(std::string_view line);
  [[noreturn]] void refuse(std::string_view what, std::string_view value) const;

  std::filesystem::path path_;
  std::string kind_;  ///< its extension
  std::vector<Column> columns_;
  std::size_t line_ = 0;
};

/// Of a whole file.
void require_finite(const std::filesystem::path& path, std::string_view content);

}  // namespace trundle::io
