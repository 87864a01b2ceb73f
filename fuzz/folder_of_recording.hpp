#pragma once

#include "trundle/recording/recording.hpp"

#include "input.hpp"

namespace trundle::fuzz {

/// Reads a folder as a recording; what was read can be written, unless something is missing, and read again.
inline int read_folder(std::string_view files) {
  static const Folder folder, copy;
  folder.clear();
  folder.write_all(files);
  recording::Recording recording;
  try_to([&] { recording = recording::read_recording(folder.path()); });
  for (const recording::Finding& finding : recording.findings) (void)recording::describe(finding);
  if (recording.inputs.empty()) return 0;
  copy.clear();
  return try_to([&] {
    recording::write_recording(recording, copy.path());
    recording::read_recording(copy.path());
  });
}

}  // namespace trundle::fuzz
