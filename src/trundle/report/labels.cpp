#include "trundle/report/labels.hpp"

#include <algorithm>
#include <filesystem>

namespace trundle::report {
namespace {

using Parts = std::vector<std::string>;

Parts parts_of(const std::string& path) {
  Parts parts;
  for (const std::filesystem::path& part : std::filesystem::path(path).lexically_normal())
    if (!part.empty()) parts.push_back(part.string());
  return parts;
}

std::string joined(const Parts& parts) {
  std::filesystem::path path;
  for (const std::string& part : parts) path /= part;
  return path.string();
}

/// Takes parts off the front of all, as long as they are the same and every path keeps one.
void strip_common_start(std::vector<Parts>& all) {
  const auto starts_like_first = [&](const Parts& parts) {
    return parts.size() > 1 && parts[0] == all[0][0];
  };
  while (std::ranges::all_of(all, starts_like_first))
    for (Parts& parts : all) parts.erase(parts.begin());
}

}  // namespace

std::vector<std::string> shortest_labels(const std::vector<std::string>& paths) {
  std::vector<Parts> all;
  for (const std::string& path : paths) all.push_back(parts_of(path));
  if (std::ranges::any_of(all, &Parts::empty)) return paths;
  strip_common_start(all);
  for (Parts& parts : all) std::ranges::reverse(parts);
  strip_common_start(all);
  std::vector<std::string> labels;
  for (Parts& parts : all) {
    std::ranges::reverse(parts);
    labels.push_back(joined(parts));
  }
  return labels;
}

}  // namespace trundle::report
