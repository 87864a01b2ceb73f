#pragma once

#include <cstddef>

namespace trundle::slam {

/// Numbers of poses, landmarks, variables and rows are signed, as −1 is none; those of elements are not.
inline std::size_t nth(std::ptrdiff_t i) {
  return static_cast<std::size_t>(i);
}

}  // namespace trundle::slam
