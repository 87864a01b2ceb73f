#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace trundle {

/// What a file of results holds, told by its name (JSON) or its header (CSV).
enum class ResultKind { trajectory, slips, landmarks, particles, filter_steps, innovations, json, other };

struct ResultFile {
  std::string name;  ///< from the folder, without extension: "slam/trajectory"
  std::filesystem::path path;
  ResultKind kind = ResultKind::other;
};

/// The results in a folder and in its folder slam/, in the order of their names; or the one file. Files that
/// hold something else are left out. Throws InputError where there is none.
std::vector<ResultFile> result_files(const std::filesystem::path& input);

/// The lines at the head of a CSV file that say how it was made, without their "# ".
std::vector<std::string> head_lines(const std::filesystem::path& path);

}  // namespace trundle
