#pragma once

#include <span>
#include <string>
#include <vector>

#include "trundle/calibration/result.hpp"
#include "trundle/recording/recording.hpp"

namespace trundle::calibration {

struct CalibrateOptions {
  std::vector<std::string> free =
      {};  ///< names of parameters to estimate besides the default ones (parameter.hpp)
  std::vector<std::string> fix = {};  ///< names of parameters to leave at nominal
  bool learn_noise = false;           ///< also of wheels, sideways motion and gyro: noise/learn_noise.hpp
  bool with_reference = false;        ///< from landmarks: positions of references count, too
};

/// The general estimator: the parameters of any chassis from any mix of recordings whose references are
/// trajectories, partial measurements, relative motions of a sensor, or only what the sensors on board say of
/// each other; with error bars within and between sessions, and what the runs cannot determine. The hold-out
/// recordings are only evaluated. Swapped ports, reversed counts and a gyro upside down are corrected first,
/// with a warning (channel_assignment.hpp). docs/calibration.md. Throws CannotAnswer when nothing can be
/// estimated or where gyro and wheels turn opposite ways and no reference shows which is right, InputError
/// for unknown parameter names.
CalibrationResult calibrate(std::span<const Recording> training, std::span<const Recording> hold_out,
                            const Robot& given, const CalibrateOptions& options = {});

}  // namespace trundle::calibration
