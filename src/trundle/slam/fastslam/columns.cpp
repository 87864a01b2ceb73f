#include "trundle/slam/fastslam/columns.hpp"

#include <algorithm>

namespace trundle::slam {

namespace {

void permute(std::span<Column<double>> columns, std::span<const std::uint32_t> parents,
             Column<double>& spare) {
  for (Column<double>& column : columns) {
    for (std::size_t i = 0; i < parents.size(); ++i) spare[i] = column[parents[i]];
    std::copy(column.begin() + static_cast<std::ptrdiff_t>(parents.size()), column.end(),
              spare.begin() + static_cast<std::ptrdiff_t>(parents.size()));
    column.swap(spare);
  }
}

}  // namespace

void TripleColumns::permute(std::span<const std::uint32_t> parents, Column<double>& spare) {
  trundle::slam::permute(columns_, parents, spare);
}

void SystematicColumns::permute(std::span<const std::uint32_t> parents, Column<double>& spare) {
  trundle::slam::permute(columns_, parents, spare);
}

}  // namespace trundle::slam
