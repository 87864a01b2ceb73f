#pragma once

#include <span>
#include <vector>

#include "trundle/slam/association/assignment.hpp"
#include "trundle/slam/fastslam/choice_kernels.hpp"

namespace trundle::slam {

/// No landmark is seen twice at one instant: where a particle has taken two sightings for the same one, all
/// sightings that may show the same landmarks are decided again together. docs/theory/association.md.
class MutualExclusion {
 public:
  explicit MutualExclusion(double cost_of_new) : cost_of_new_(cost_of_new) {}

  /// Of the sightings of one instant, once particles have chosen.
  void apply(std::span<Hypotheses* const> sightings, std::size_t particles);

 private:
  void group_by_candidates(std::span<Hypotheses* const> sightings);
  bool find_conflicts(std::size_t particles);
  void set_up_costs();
  void decide_together(std::size_t particle);

  /// A candidate's place in the matrix of costs.
  struct Entry {
    Eigen::Index row, column;
    const double* costs;  ///< by particle
  };

  double cost_of_new_;
  std::vector<std::size_t> group_of_;  ///< of each sighting
  // Of one group.
  std::vector<Hypotheses*> group_;
  std::vector<std::int32_t> conflict_;  ///< for each particle; 0: none
  std::vector<LandmarkId> landmarks_;
  std::vector<Entry> entries_;
  Eigen::MatrixXd cost_;
  CheapestAssignment assignment_;
};

}  // namespace trundle::slam
