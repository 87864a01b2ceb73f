#pragma once

#include <exception>
#include <optional>
#include <string>
#include <vector>

#include "trundle/pipeline/files.hpp"
#include "trundle/pipeline/run.hpp"
#include "trundle/pipeline/slip_answer.hpp"

namespace trundle {

/// What the stages of a run hand on to each other.
struct Work {
  RunQuestion question;
  RobotFile given;                    ///< before the calibration
  RobotFile used;                     ///< after it
  std::vector<Recording> recordings;  ///< what is asked about: one, or those of a session
  std::vector<Recording> training;    ///< where others are to be learned from
  RunAnswer answer;
  std::exception_ptr no_odometry;        ///< why there is none
  std::optional<SlipAnswer> slip = {};   ///< where slip could be looked for
  OnSteps on_steps;                      ///< of the stage that runs
  std::vector<Finding> misread = {};     ///< findings after which some stages would tell nonsense
  std::vector<std::string> clocks = {};  ///< what is wrong with the gyro's, until it is corrected

  const Recording& recording() const { return recordings.front(); }
  std::filesystem::path in_folder(const std::string& name) const { return question.output / name; }
};

/// What a stage tells when it is done, and what it wants written.
struct Told {
  std::string message;
  std::vector<OutputFile> files;
  std::vector<std::string> remarks = {};
};

/// Why a stage has nothing to do.
struct NotApplicable {
  std::string why;
};

// The stages, each from the work of those before it. They throw NotApplicable, CannotAnswer, InputError.
Told check_health(Work& work);
Told calibrate_robot(Work& work);
Told integrate_odometry(Work& work);
Told find_slips(Work& work);
Told localize_on_map(Work& work);
Told map_landmarks(Work& work);
Told evaluate_trajectories(Work& work);
Told draw_page(Work& work);

/// The bytes that a command with --json prints.
std::string printed(const nlohmann::ordered_json& document);

}  // namespace trundle
