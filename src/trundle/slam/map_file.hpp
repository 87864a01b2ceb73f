#pragma once

#include <string>
#include <vector>

#include "trundle/slam/report.hpp"

namespace trundle::slam {

/// A name for each landmark up to `last`: the given ones, then 1, 2, ... but for what is a name already.
[[nodiscard]] std::vector<std::string> landmark_names(std::vector<std::string> given, LandmarkId last);

/// landmarks.csv: `landmark,x_m,y_m,var_xx,var_xy,var_yy,sightings`, in the order of the map. `names`:
/// SlamInput::landmarks; landmarks without names are called as landmark_names() does.
[[nodiscard]] std::string to_csv(const std::vector<MappedLandmark>& map,
                                 const std::vector<std::string>& names);

}  // namespace trundle::slam
