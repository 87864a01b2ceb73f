#pragma once

#include <vector>

#include <Eigen/Core>

namespace trundle {

/// Which column each row gets, no column twice, so that the sum of the costs is least (Hungarian method
/// [Kuhn 1955], O(rows² · columns)). At least as many columns as rows; finite costs.
std::vector<Eigen::Index> cheapest_assignment(const Eigen::MatrixXd& cost);

}  // namespace trundle
