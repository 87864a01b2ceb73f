#include "trundle/report/result_files.hpp"

#include <algorithm>
#include <array>
#include <tuple>

#include "trundle/io/error.hpp"
#include "trundle/io/file.hpp"

namespace trundle::report {
namespace {

constexpr std::array<std::string_view, 8> kDocuments = {"run",  "info", "calibration", "odometry",
                                                        "slip", "slam", "evaluation",  "growth"};
/// A header holds all of these words.
struct Sign {
  ResultKind kind;
  std::array<std::string_view, 3> columns;
};
constexpr std::array kSigns = {
    Sign{ResultKind::trajectory, {"time_s", "x_m", "heading_rad"}},
    Sign{ResultKind::slips, {"start_s", "wheel", "excess_m"}},
    Sign{ResultKind::landmarks, {"landmark", "x_m", "y_m"}},
    Sign{ResultKind::particles, {"x_m", "heading_rad", "weight"}},
    Sign{ResultKind::filter_steps, {"time_s", "effective_particles", "resampled"}},
    Sign{ResultKind::innovations, {"time_s", "landmark", "nis"}},
};

ResultKind kind_of_file(const std::filesystem::path& path) {
  const std::string content = path.extension() == ".csv" ? read_file(path) : std::string();
  return kind_of(path, header_of(content));
}

void append_results(const std::filesystem::path& folder, const std::string& prefix,
                    std::vector<ResultFile>& files) {
  if (!std::filesystem::is_directory(folder)) return;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    const ResultKind kind = kind_of_file(entry.path());
    if (kind != ResultKind::other)
      files.push_back({prefix + entry.path().stem().string(), entry.path(), kind});
  }
}

}  // namespace

std::vector<ResultFile> result_files(const std::filesystem::path& input) {
  constexpr const char* kExpected =
      "a folder with results of trundle, like calibration.json, trajectory.csv, slip.csv or slam/, or one of "
      "these";
  if (!std::filesystem::exists(input)) throw InputError(input.string(), "does not exist", kExpected);
  std::vector<ResultFile> files;
  if (std::filesystem::is_directory(input)) {
    append_results(input, "", files);
    append_results(input / "slam", "slam/", files);
  } else if (const ResultKind kind = kind_of_file(input); kind != ResultKind::other) {
    files.push_back({input.stem().string(), input, kind});
  }
  if (files.empty()) throw InputError(input.string(), "holds no results", kExpected);
  std::ranges::sort(files, [](const ResultFile& a, const ResultFile& b) {
    return std::tie(a.name, b.path) < std::tie(b.name, a.path);
  });
  return files;
}

std::string_view header_of(std::string_view content) {
  std::size_t end = content.find('\n');
  while (content.starts_with('#') && end != content.npos) {
    content.remove_prefix(end + 1);
    end = content.find('\n');
  }
  return content.starts_with('#') ? std::string_view() : content.substr(0, end);
}

ResultKind kind_of(const std::filesystem::path& path, std::string_view header) {
  const std::string extension = path.extension().string();
  if (extension == ".tum") return ResultKind::trajectory;
  if (extension == ".json")
    return std::ranges::find(kDocuments, path.stem().string()) == kDocuments.end() ? ResultKind::other
                                                                                   : ResultKind::json;
  if (extension != ".csv") return ResultKind::other;
  const auto holds = [&](std::string_view column) { return header.find(column) != header.npos; };
  for (const Sign& sign : kSigns)
    if (std::ranges::all_of(sign.columns, holds)) return sign.kind;
  return ResultKind::other;
}

}  // namespace trundle::report
