#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "trundle/namespaces.hpp"

namespace trundle::report {

/// What a file of results holds, told by its name (JSON) or its header (CSV).
enum class ResultKind { trajectory, slips, landmarks, particles, filter_steps, innovations, json, other };

struct ResultFile {
  std::string name;  ///< from the folder, without extension: "slam/trajectory"
  std::filesystem::path path;
  ResultKind kind = ResultKind::other;
};

/// The results in a folder and in its folder slam/, in the order of their names, of two the .json before the
/// .csv; or the one file. Files that hold something else are left out. Throws InputError where there is none.
std::vector<ResultFile> result_files(const std::filesystem::path& input);

/// The first line of a CSV file that is no comment.
std::string_view header_of(std::string_view content);
/// What a file of this name holds; of a CSV file by its header.
ResultKind kind_of(const std::filesystem::path& path, std::string_view header);

}  // namespace trundle::report
