#include "trundle/pipeline/files.hpp"

#include <set>

#include "trundle/io/error.hpp"
#include "trundle/io/staging.hpp"

namespace trundle::pipeline {

namespace fs = std::filesystem;

RobotFile read_robot_file(const std::filesystem::path& path) {
  return {read_robot(path), input_file(path)};
}

std::vector<Recording> read_recordings(const std::vector<std::string>& folders, const ReadOptions& options) {
  std::vector<Recording> recordings;
  for (const std::string& folder : folders)
    for (const std::filesystem::path& path : recordings_below(folder))
      recordings.push_back(read_recording(path, options));
  return recordings;
}

void require_apart(std::span<const Recording> recordings, const std::vector<std::filesystem::path>& outputs) {
  const auto is_same = [](const fs::path& a, const fs::path& b) {
    std::error_code cannot_tell;  // one of them is not there
    return fs::equivalent(a, b, cannot_tell);
  };
  for (const fs::path& output : outputs)
    for (const Recording& recording : recordings)
      for (const InputFile& input : recording.inputs)
        if (const fs::path read = input.path; is_same(output, read) || is_same(output, read.parent_path()))
          throw InputError(output.string(), "is part of a recording, which would be lost",
                           "another place for results");
}

void write_files(const std::vector<OutputFile>& files, const std::vector<InputFile>& inputs) {
  std::vector<fs::path> outputs;
  std::set<fs::path> places;
  for (const OutputFile& file : files) {
    outputs.push_back(file.path);
    if (!places.insert(fs::weakly_canonical(fs::absolute(file.path))).second)
      throw InputError(file.path.string(), "is to hold two results", "a file for each");
  }
  require_apart(inputs, outputs);
  std::vector<FileContent> contents;
  std::set<fs::path> folders;
  for (const OutputFile& file : files) {
    contents.push_back({file.path, file.content, file.rest});
    folders.insert(file.path.parent_path());
  }
  write_set(std::move(contents));
  for (const fs::path& folder : folders) remove_stale(folder);
}

}  // namespace trundle::pipeline
