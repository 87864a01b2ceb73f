#include "trundle/pipeline/files.hpp"

namespace trundle {

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

void write_files(const std::vector<OutputFile>& files) {
  for (const OutputFile& file : files) write_file(file.path, file.content);
}

}  // namespace trundle
