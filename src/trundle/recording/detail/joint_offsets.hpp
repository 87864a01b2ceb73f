#pragma once

#include <array>
#include <functional>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "trundle/recording/detail/offset_search.hpp"

namespace trundle::recording {

/// Two clocks that one comparison depends on.
struct JointClocks {
  /// As TwoClocks::Other.
  using Moved =
      std::function<std::vector<Eigen::MatrixXd>(const Eigen::Vector2d& offsets_s, std::vector<bool>& used)>;

  std::vector<Eigen::VectorXd> fixed;  ///< an entry for each channel
  Eigen::VectorXd duration_s;          ///< of each window
  std::vector<bool> used;
  Moved moved;
  std::array<OffsetSearch, 2> search;  ///< of each offset
};

struct JointOffsets {
  std::array<std::optional<TimeOffset>, 2> each;  ///< with what the other one leaves open
  /// How much farther the first is from what it is given as than the second: told also where a motion that
  /// both see alike tells neither.
  std::optional<TimeOffset> apart;
};

/// The offsets at which fixed = moved · slopes + drift · duration + residual leaves least: by lines along
/// each and along both alike, and by Newton's steps from there. Windows and σ as find_offset() has them.
[[nodiscard]] JointOffsets find_offsets(const JointClocks& clocks);

}  // namespace trundle::recording
