#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "trundle/chassis/robot.hpp"
#include "trundle/io/file.hpp"
#include "trundle/io/pieces.hpp"
#include "trundle/recording/recording.hpp"

namespace trundle::pipeline {

/// A robot, and the file that said so.
struct RobotFile {
  Robot robot;
  InputFile file;
};
/// Throws as read_robot.
[[nodiscard]] RobotFile read_robot_file(const std::filesystem::path& path);

/// The recordings in and below each of these folders, in order. Throws as read_recording.
[[nodiscard]] std::vector<Recording> read_recordings(const std::vector<std::string>& folders,
                                                     const ReadOptions& options = {});

/// Nothing that was recorded is written over, before anything is computed: throws InputError where one of the
/// outputs, files or folders of them, is a file that was read, or the folder of a recording itself.
void require_apart(std::span<const Recording> recordings, const std::vector<std::filesystem::path>& outputs);

/// A file of a result, complete before the first of them is written.
struct OutputFile {
  std::filesystem::path path;
  std::string content;
  /// What follows it, where that is too long to be kept as text: called while the file is written.
  std::function<void(const TakeText&)> rest = {};
  std::string sha256 = {};  ///< of one that is written already; the content is its beginning
};
/// All of them or none (write_set), and none where one holds a number that is none, is among what they were
/// made from, or two have one place.
void write_files(const std::vector<OutputFile>& files, const std::vector<InputFile>& inputs);

}  // namespace trundle::pipeline
