#include "slip_correction.hpp"

namespace trundle::app {

void add_slip_correction(CLI::App& command, SlipCorrection& correction) {
  CLI::Option* wanted =
      command.add_flag("--correct-slip", correction.wanted,
                       "Find the slips first and go on from the odometry corrected for them");
  command.add_option("--learn", correction.learn, "Recordings without slip, to measure the noise on")
      ->needs(wanted);
}

std::optional<SlipQuestion> question_of(const SlipCorrection& correction, int robot_number) {
  if (!correction.wanted) return std::nullopt;
  return SlipQuestion{.learn = correction.learn, .robot_number = robot_number};
}

}  // namespace trundle::app
