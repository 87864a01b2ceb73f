#include "trundle/slam/map_file.hpp"

#include <algorithm>
#include <set>

#include <fmt/format.h>

#include "trundle/recording/landmark_file.hpp"

namespace trundle::slam {

std::vector<std::string> landmark_names(std::vector<std::string> given, LandmarkId last) {
  const std::set<std::string> taken(given.begin(), given.end());
  for (int number = 1; static_cast<LandmarkId>(given.size()) <= last; ++number)
    if (!taken.contains(std::to_string(number))) given.push_back(std::to_string(number));
  return given;
}

std::string to_csv(const std::vector<MappedLandmark>& map, const std::vector<std::string>& names) {
  LandmarkId last = kUnknownLandmark;
  for (const MappedLandmark& m : map) last = std::max(last, m.id);
  const std::vector<std::string> all = landmark_names(names, last);
  std::string text = "landmark,x_m,y_m,var_xx,var_xy,var_yy,sightings\n";
  for (const MappedLandmark& m : map)
    text +=
        fmt::format("{},{},{},{},{},{},{}\n", text_cell(all[static_cast<std::size_t>(m.id)]), m.position.x(),
                    m.position.y(), m.covariance(0, 0), m.covariance(0, 1), m.covariance(1, 1), m.sightings);
  return text;
}

}  // namespace trundle::slam
