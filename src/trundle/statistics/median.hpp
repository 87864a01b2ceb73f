#pragma once

#include <vector>

namespace trundle {

/// Of an even number of values the upper of the two in the middle; NaN of none.
double median(std::vector<double> values);

}  // namespace trundle
