#pragma once

#include <array>
#include <string>

#include <gtest/gtest.h>

#include "trundle/slam/fastslam/particle_slam.hpp"

namespace trundle::test {
using namespace slam;

inline auto every_proposal() {
  return testing::Values(Proposal::motion, Proposal::linearised, Proposal::swarm, Proposal::swarm_gaussian);
}

inline std::string name_of_proposal(const testing::TestParamInfo<Proposal>& proposal) {
  constexpr std::array kNames = {"motion", "linearised", "swarm", "swarm_gaussian"};
  return kNames[static_cast<std::size_t>(proposal.param)];
}

}  // namespace trundle::test
