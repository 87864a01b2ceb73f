#include <algorithm>
#include <optional>

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

using recording::CsvFormat;
using recording::CsvTable;

/// The first delimiter that makes columns of the text.
CsvFormat format_of(const std::string& text, const std::string& file) {
  for (const char delimiter : {',', ';', '\t', '|'})
    if (CsvTable(text, file, {.delimiter = delimiter}).columns() > 1) return {.delimiter = delimiter};
  return {};
}

/// As recording.toml says it; what goes without saying is left out.
std::string lines_of(const CsvFormat& format) {
  std::string lines;
  if (format.delimiter != ',')
    lines += fmt::format("delimiter = \"{}\"\n",
                         format.delimiter == '\t' ? "\\t" : std::string(1, format.delimiter));
  if (format.decimal != '.') lines += fmt::format("decimal = \"{}\"\n", format.decimal);
  return lines;
}

/// Each column by itself where they do not all hold numbers: a column of text is none of a stream.
void add_fields(const CsvTable& csv, logs::TopicSummary& table) {
  std::optional<InputError> fault;
  for (std::size_t i = 0; i < csv.names().size(); ++i) {
    const recording::CsvColumn column{i};
    logs::FieldSummary field{.path = csv.names()[i]};
    try {
      const recording::CsvRows rows = csv.read({&column, 1});
      table.messages = rows.count();
      for (const double number : rows.numbers.front()) field.add(number);
    } catch (const InputError& error) {
      field.is_text = true;
      if (!fault) fault = error;
    }
    table.paths.push_back(field.path);
    table.fields.push_back(std::move(field));
  }
  if (fault && std::ranges::all_of(table.fields, &logs::FieldSummary::is_text)) throw InputError(*fault);
}

std::size_t numbers_in(const logs::TopicSummary& table) {
  return static_cast<std::size_t>(std::ranges::count(table.fields, false, &logs::FieldSummary::is_text));
}

/// Where it cannot be read, `unreadable` says why.
logs::TopicSummary summary_of_table(const std::filesystem::path& path, const std::string& name) {
  const std::string text = head_of_file(path);
  const auto read = [&](const CsvFormat& format) {
    logs::TopicSummary table{.topic = name, .type = "CSV", .metadata = lines_of(format)};
    add_fields(CsvTable(text, path.string(), format), table);
    return table;
  };
  try {
    const CsvFormat format = format_of(text, path.string());
    logs::TopicSummary table = read(format);
    if (format.delimiter == ',') return table;
    CsvFormat with_comma = format;
    with_comma.decimal = ',';
    logs::TopicSummary other = read(with_comma);
    return numbers_in(other) > numbers_in(table) ? other : table;
  } catch (const InputError& error) {
    return {.topic = name, .type = "CSV", .unreadable = error.what()};
  }
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
