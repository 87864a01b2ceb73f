#include "trundle/inspection/same_data.hpp"

#include <filesystem>
#include <set>

namespace trundle::inspection {
namespace {

std::set<std::string> contents_of(const Recording& recording) {
  std::set<std::string> contents;
  for (const InputFile& input : recording.inputs)
    if (!input.path.ends_with("recording.toml")) contents.insert(input.sha256);
  return contents;
}

}  // namespace

bool same_data(const Recording& a, const Recording& b) {
  const std::set<std::string> contents = contents_of(a);
  return !contents.empty() && contents == contents_of(b) && a.wheels.time_s == b.wheels.time_s &&
         a.reference.time_s == b.reference.time_s;
}

std::string folder_of(const Recording& recording) {
  if (recording.inputs.empty()) return recording.name;
  return std::filesystem::path(recording.inputs.front().path).parent_path().generic_string();
}

}  // namespace trundle::inspection
