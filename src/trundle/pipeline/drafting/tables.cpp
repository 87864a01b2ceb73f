#include <algorithm>

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

/// Where it cannot be read, `unreadable` says why.
logs::TopicSummary summary_of_table(const std::filesystem::path& path, const std::string& name) {
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
      logs::FieldSummary& field = table.fields.emplace_back(logs::FieldSummary{.path = csv.names()[i]});
      for (const double number : rows.numbers[i]) field.add(number);
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
    summary.topics.push_back(summary_of_table(file, file.filename().string()));
  return summary;
}

}  // namespace trundle::pipeline
