#pragma once

#include <string>
#include <vector>

#include "trundle/namespaces.hpp"

namespace trundle::report {

/// The parts of paths that distinguish them: without the folders that all of them start and end with.
std::vector<std::string> shortest_labels(const std::vector<std::string>& paths);

}  // namespace trundle::report
