#pragma once

#include <cstddef>

namespace trundle::slam {

/// Numbers of variables and terms are int, as −1 is none; those of elements are not.
inline std::size_t nth(int i) {
  return static_cast<std::size_t>(i);
}

}  // namespace trundle::slam
