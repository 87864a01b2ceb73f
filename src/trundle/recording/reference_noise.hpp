#pragma once

#include <string>

#include "trundle/namespaces.hpp"

namespace trundle::recording {

/// What a reference trajectory is known to, as its owner states it; zero: taken as exact.
struct ReferenceSigmas {
  double position_sigma_m = 0.0;  ///< of x and of y each
  double heading_sigma_rad = 0.0;

  bool stated() const { return position_sigma_m > 0.0 || heading_sigma_rad > 0.0; }
};

/// As lines of [reference]; empty where nothing is stated.
std::string to_toml(const ReferenceSigmas& noise);

}  // namespace trundle::recording
