// EkfSlam, where sightings have no id.
#include <algorithm>

#include "trundle/slam/ekf/ekf.hpp"

namespace trundle::slam {

/// Which landmark each shows: the most probable explanation of all of them together. Eq. 21, 22.
void EkfSlam::associate_unidentified() {
  unidentified_.begin(observations_);
  if (unidentified_.observations().empty()) return;
  const std::vector<std::vector<std::size_t>> candidates = find_candidates();
  stacked_.H.clear();
  stacked_.matches.clear();
  for (std::size_t k = 0; k < candidates.size(); ++k)
    for (const std::size_t landmark : candidates[k]) pair(k, landmark);
  set_innovation_covariance();
  const auto rows = 2 * static_cast<Index>(stacked_.matches.size());
  Eigen::VectorXd innovation(rows);
  for (std::size_t p = 0; p < stacked_.matches.size(); ++p)
    innovation.segment<2>(2 * static_cast<Index>(p)) = stacked_.matches[p].innovation;
  unidentified_.decide(std::move(innovation), stacked_.S.topLeftCorner(rows, rows), report_);
}

/// Landmarks near where each points, made active.
std::vector<std::vector<std::size_t>> EkfSlam::find_candidates() {
  if (table_.off_grid_m() > kOffGridShare * sensor_.max_range_m) refresh_grid();
  const auto candidates = unidentified_.candidates(joint_.body(), table_.grid(), 2.0 * table_.off_grid_m());
  in_view_.clear();
  for (const std::vector<std::size_t>& near : candidates)
    in_view_.insert(in_view_.end(), near.begin(), near.end());
  std::ranges::sort(in_view_);
  in_view_.erase(std::unique(in_view_.begin(), in_view_.end()), in_view_.end());
  joint_.activate(in_view_);
  return candidates;
}

/// Stacks the pairing, if it is one.
void EkfSlam::pair(std::size_t sighting, std::size_t landmark) {
  const std::size_t i = unidentified_.observations()[sighting];
  const Index at = joint_.index_of(landmark);
  const ExpectedReading expected =
      expected_reading(joint_.pose(), sensor_.body_from_sensor, joint_.active(at));
  const JointGaussian::Rows rows{at, expected.by_pose, expected.by_landmark};
  const Vector2 innovation = innovation_of(observations_[i], expected);
  if (!unidentified_.consider(sighting, landmark, innovation, joint_.projected_covariance(rows) + R_)) return;
  stacked_.matches.push_back({i, landmark, innovation});
  stacked_.H.push_back(rows);
}

void EkfSlam::update_existence() {
  const std::vector<std::size_t> gone = unidentified_.update_existence(
      joint_.pose(), report_, table_.grid(), table_.visibility(),
      [this](std::size_t landmark) -> Existence& { return table_.existence(static_cast<int>(landmark)); });
  for (const std::size_t landmark : gone) {
    joint_.remove(landmark);
    table_.remove(static_cast<int>(landmark));
  }
  if (!gone.empty()) refresh_grid();
}

void EkfSlam::refresh_grid() {
  table_.refresh_grid([this](int landmark) { return joint_.landmark(static_cast<std::size_t>(landmark)); });
}

}  // namespace trundle::slam
