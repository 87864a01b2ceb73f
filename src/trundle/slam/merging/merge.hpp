#pragma once

#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "trundle/geometry/pose2.hpp"

namespace trundle::slam {

/// A map in a frame of its own, with the covariance of all its landmarks together: how they err in common is
/// what tells how well distances in it are known.
struct JointMap {
  std::string from = {};                ///< for messages
  std::vector<std::string> names = {};  ///< of its landmarks
  std::vector<Vector2> positions = {};  ///< [m]
  Eigen::MatrixXd covariance = {};      ///< x and y of each [m²], in the metre of its sensor
  double metre_sigma = 0.0;             ///< Metre::sigma of that
};

struct MergeOptions {
  bool unknown_ids = false;  ///< names mean nothing: which landmark is which follows from how they lie
  /// Probability with which what belongs together is taken for what does not; and with which what chance or
  /// another place explains is taken for the right one.
  double tail = 1e-3;
};

/// Several maps as one, in the frame of the first, and in its metre.
struct MergedMap {
  JointMap map;
  std::vector<Pose2> first_from_map = {};      ///< where the frame of each lies
  std::vector<Matrix3> frame_covariance = {};  ///< of (x, y, heading) in the first's axes; 0 of the first
  std::vector<double> metre = {};              ///< by what share lengths in each are longer than in the first
  std::vector<double> metre_sigma = {};        ///< 1σ of that
  std::vector<std::vector<std::size_t>> landmark_of =
      {};                      ///< by map, by its landmark: number in the merged one
  double cost = 0.0;           ///< χ² of all maps' landmarks about the merged ones
  int degrees_of_freedom = 0;  ///< what the cost should be near
};

/// Which landmarks two maps share is the largest set that lies in both alike: frames from each two landmarks
/// that are as far apart in both maps, each tested with all others; then one least-squares problem over all
/// frames and landmarks. docs/theory/merge.md, eq. 29 to 32. Throws CannotAnswer with the reason: no
/// overlap, or ambiguous.
[[nodiscard]] MergedMap merge_maps(std::span<const JointMap> maps, const MergeOptions& options = {});

}  // namespace trundle::slam
