#pragma once

#include <functional>

#include "trundle/namespaces.hpp"

namespace trundle::statistics {

struct Bracket {
  double low = 0.0;
  double high = 0.0;
  double tolerance = 0.0;  ///< to which the place of the minimum is wanted, above √ε of its size
};

/// Where a function of one minimum between two places has it [Brent 1973].
double minimum_within(const Bracket& bracket, const std::function<double(double)>& function);

}  // namespace trundle::statistics
