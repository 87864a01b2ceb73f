#pragma once

#include <limits>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "trundle/namespaces.hpp"

namespace trundle::slam {

/// An observation that may show a landmark: rows 2p and 2p + 1 of the innovations, p its place in the list.
struct Pairing {
  std::size_t observation;
  std::size_t landmark;
};

/// All pairings of the observations of one instant that are not hopeless.
struct JointReadings {
  std::size_t observations = 0;
  std::vector<Pairing> pairings;  ///< ascending by observation
  Eigen::VectorXd innovation;     ///< two for each pairing
  Eigen::MatrixXd S;  ///< their covariance; between pairings of one observation it does not matter
};

/// Costs are −2 log densities of (range, bearing) [m, rad].
struct JointCompatibilityOptions {
  double none = 0.0;              ///< −2 log density of an observation that shows none of the landmarks
  double least = -1e9;            ///< −2 log density that no reading falls below: that of its noise alone
  std::span<const double> limit;  ///< NIS of k pairings together is at most limit[k]
  std::size_t most = 1;           ///< explanations
  double within = std::numeric_limits<double>::infinity();  ///< of the best one's −2 log density
  int most_nodes = 4096;                                    ///< of the search tree: bounds its time, some ms
};

/// limit[k] for k up to `most`: consistent innovations are above it as rarely as one of χ²₂ above `gate`.
[[nodiscard]] std::vector<double> joint_limits(double gate, std::size_t most);

/// What all observations of one instant show.
struct JointExplanation {
  static constexpr int kNone = -1;
  std::vector<int> pairing;  ///< of each observation: index into the pairings; kNone
  double cost = 0.0;         ///< −2 log density of all
};

/// The most probable explanations of all observations together, the best first, in which no landmark is seen
/// twice and whose innovations are jointly compatible [Neira & Tardos 2001]. The density takes the
/// correlation between innovations into account: what moves all of them alike, an unsure heading, explains
/// all of them at once. Branch and bound; where the bound on the work ends the search, the best found so far.
/// docs/theory/association.md, eq. 21, 22.
[[nodiscard]] std::vector<JointExplanation> most_probable_explanations(
    const JointReadings& readings, const JointCompatibilityOptions& options);

}  // namespace trundle::slam
