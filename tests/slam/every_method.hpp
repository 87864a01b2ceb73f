#pragma once

#include <vector>

#include "trundle/slam/slam.hpp"

namespace trundle::test {

/// All that the command line knows.
inline std::vector<slam::SlamMethod> every_method() {
  std::vector<slam::SlamMethod> methods;
  for (const std::string& name : slam::slam_method_names()) methods.push_back(*slam::slam_method_named(name));
  return methods;
}

}  // namespace trundle::test
