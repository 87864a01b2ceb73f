#pragma once

#include <string>
#include <vector>

#include "trundle/slam/report.hpp"
#include "trundle/slam/steps.hpp"

namespace trundle::pipeline {

/// innovations.csv: a row for each sighting, what a filter made of it.
inline constexpr const char* kInnovationColumns =
    "time_s,landmark,decision,range_innovation_m,bearing_innovation_rad,nis\n";

/// Which landmark a row is of: what the observation itself says, else what it was taken for; may be empty.
std::string landmark_in(const Observation& observation, const ObservationReport& report,
                        const std::vector<std::string>& names);

/// Appends the rows of one step; `names` are those of the LandmarkIds.
void append_innovations(std::string& text, const SlamStep& step,
                        const std::vector<ObservationReport>& reports, const std::vector<std::string>& names);

}  // namespace trundle::pipeline
