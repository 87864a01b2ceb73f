#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "trundle/namespaces.hpp"

namespace trundle::report {

/// Columns of a CSV file that the program wrote. Throws InputError where a required one is missing, and as
/// CsvTable does.
class CsvColumns {
 public:
  /// Reads these columns as numbers, and those as text; what is in `optional` may be missing.
  CsvColumns(const std::filesystem::path& path, std::vector<std::string> numbers,
             std::vector<std::string> texts = {}, std::vector<std::string> optional = {});

  std::size_t count() const { return count_; }
  bool has(std::string_view name) const;
  /// Empty where it is missing.
  const std::vector<double>& numbers(std::string_view name) const;
  const std::vector<std::string>& texts(std::string_view name) const;

 private:
  std::vector<std::string> number_names_;
  std::vector<std::string> text_names_;
  std::vector<std::vector<double>> numbers_;
  std::vector<std::vector<std::string>> texts_;
  std::size_t count_ = 0;
};

}  // namespace trundle::report
