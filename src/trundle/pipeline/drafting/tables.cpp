#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/pipeline/drafting/draft.hpp"
#include "trundle/recording/csv/reader.hpp"

namespace trundle::pipeline {
namespace {

/// As much of a table as tells what its columns are [bytes].
constexpr std::size_t kHeadOfTable = std::size_t{8} << 20;

std::string head_of_file(const std::filesystem::path& path) {
  FilePieces pieces(path);
  std::string text;
  for (std::string_view piece = pieces.next(); !piece.empty() && text.size() < kHeadOfTable;
       piece = pieces.next())
    text += piece;
  return text.substr(0, text.size() < kHeadOfTable ? text.size() : text.rfind('\n') + 1);
}

logs::FieldSummary summary_of(const std::string& name, const std::vector<double>& values) {
  logs::FieldSummary field{.path = name};
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    if (field.values++ == 0) {
      field.first = field.last = field.least = field.most = value;
      continue;
    }
    field.changes += value != field.last ? 1 : 0;
    field.falls += value < field.last ? 1 : 0;
    field.travel += std::abs(value - field.last);
    field.least = std::min(field.least, value);
    field.most = std::max(field.most, value);
    field.last = value;
  }
  return field;
}

/// Nothing: it has no header, or no rows of numbers.
std::optional<logs::TopicSummary> summary_of_table(const std::filesystem::path& path,
                                                   const std::string& name) {
  const std::string text = head_of_file(path);
  logs::TopicSummary table{.topic = name, .type = "CSV"};
  try {
    const recording::CsvTable csv(text, path.string(), {});
    std::vector<recording::CsvColumn> columns;
    for (std::size_t i = 0; i < csv.names().size(); ++i) columns.push_back({i});
    const recording::CsvRows rows = csv.read(columns);
    table.messages = rows.count();
    for (std::size_t i = 0; i < columns.size(); ++i) {
      table.paths.push_back(csv.names()[i]);
      table.fields.push_back(summary_of(csv.names()[i], rows.numbers[i]));
    }
  } catch (const InputError& error) {
    table.unreadable = error.what();
  }
  return table;
}

}  // namespace

logs::LogSummary survey_tables(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string ending = entry.path().extension().string();
    if (entry.is_regular_file() && (ending == ".csv" || ending == ".CSV")) files.push_back(entry.path());
  }
  if (files.empty())
    throw InputError(folder.string(), "holds no CSV file", "a log, or a folder of CSV files");
  std::ranges::sort(files);
  logs::LogSummary summary;
  summary.format = "CSV";
  for (const std::filesystem::path& file : files)
    if (std::optional<logs::TopicSummary> table = summary_of_table(file, file.filename().string()))
      summary.topics.push_back(std::move(*table));
  return summary;
}

}  // namespace trundle::pipeline
