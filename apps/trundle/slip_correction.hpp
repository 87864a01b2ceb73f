#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "trundle/pipeline/slip_answer.hpp"

#include "names.hpp"

namespace trundle::app {

/// What --correct-slip and --learn say, of commands that go on from the odometry.
struct SlipCorrection {
  bool wanted = false;
  std::vector<std::string> learn;
  double spin_odds = SlipOptions{}.spin_odds;
};

CLI::Option* add_spin_odds(CLI::App& command, double& spin_odds);
void add_slip_correction(CLI::App& command, SlipCorrection& correction);
std::optional<SlipQuestion> question_of(const SlipCorrection& correction, const ReadOptions& reading);

}  // namespace trundle::app
