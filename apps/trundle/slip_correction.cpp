#include "slip_correction.hpp"

#include "command.hpp"

namespace trundle::app {

CLI::Option* add_spin_odds(CLI::App& command, double& spin_odds) {
  return command
      .add_option("--spin-odds", spin_odds,
                  "How much likelier a driven wheel that slips while it pushes spins than skids")
      ->check(number_from(1e-6, 1e6))
      ->capture_default_str();
}

void add_slip_correction(CLI::App& command, SlipCorrection& correction) {
  CLI::Option* wanted =
      command.add_flag("--correct-slip", correction.wanted,
                       "Find the slips first and go on from the odometry corrected for them");
  command.add_option("--learn", correction.learn, "Recordings without slip, to measure the noise on")
      ->needs(wanted);
  add_spin_odds(command, correction.spin_odds)->needs(wanted);
}

std::optional<SlipQuestion> question_of(const SlipCorrection& correction, const ReadOptions& reading) {
  if (!correction.wanted) return std::nullopt;
  return SlipQuestion{.learn = correction.learn, .spin_odds = correction.spin_odds, .reading = reading};
}

}  // namespace trundle::app
