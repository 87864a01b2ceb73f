#pragma once

#include <optional>
#include <string>
#include <vector>

#include "trundle/calibration/likelihood/errors_in_variables.hpp"
#include "trundle/calibration/likelihood/reading_noise.hpp"
#include "trundle/chassis/parameter.hpp"
#include "trundle/recording/alignment/align.hpp"
#include "trundle/slam/models/observation.hpp"
#include "trundle/slam/models/systematic_errors.hpp"

namespace trundle::slam {

/// What a filter is given at once: how the body moved since the step before, and what it sees at the end.
struct SlamStep {
  double time_s = 0.0;
  Motion motion;                          ///< since the step before
  std::vector<Observation> observations;  ///< all of one instant
  /// What standing still showed since the step before, and the motion knows nothing of.
  std::optional<BiasReading> bias_reading = {};

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.time_s, self.motion, self.observations, self.bias_reading);
  }
};

/// A recording as a filter wants it.
struct SlamInput {
  double start_s = 0.0;
  std::vector<SlamStep> steps;
  std::vector<std::string> landmarks;  ///< name of each LandmarkId: those given, then in order of first sight
  std::vector<Finding> findings;
  SystematicErrors systematic = {};  ///< what the motions' s are
  double rest_s = 0.0;               ///< how long the robot stood still, where it has a gyro
  /// Of each step's motion, by SlamInputOptions::parameters: truth = mean · exp(by_parameters · (true value −
  /// the robot's) + e).
  std::vector<Eigen::Matrix3Xd> by_parameters = {};
  /// Likewise: how errors of readings go with that of the motion. docs/theory/landmark-calibration.md, eq.
  /// 13d.
  std::vector<calibration::ReadingErrors> reading_errors = {};
  /// Of each observation, step by step: which of the sightings it is, counted in the order of time.
  std::vector<std::size_t> sighting_numbers = {};

  /// Of all steps.
  [[nodiscard]] std::size_t observations() const;
  /// Whether some sighting has no id.
  [[nodiscard]] bool has_unidentified() const;
  /// Number of the first unidentified landmark: above all given ids.
  [[nodiscard]] LandmarkId first_unidentified() const { return static_cast<LandmarkId>(landmarks.size()); }
};

/// Of one instant: more are thinned out evenly, so that no step takes without bound.
inline constexpr std::size_t kMostSightingsAtOnce = 200;

/// How a recording is cut into steps.
struct SlamInputOptions {
  double longest_step_s = 0.1;  ///< without sightings a step ends with the first interval after so long
  bool hide_ids = false;        ///< every sighting's landmark is unknown
  std::vector<std::string> names = {};  ///< those of a map: they are the first LandmarkIds, in this order
  /// Whose effect on every motion is wanted (SlamInput::by_parameters). Then the gyro's bias is that of the
  /// robot file, at rest too.
  std::vector<Parameter> parameters = {};
  calibration::ReadingNoise reading_noise = {};  ///< with parameters; slam_input() finds it in the readings
  bool with_scatter = false;                     ///< likewise: also ReadingErrors::scatter
  std::vector<double> also_at_s = {};            ///< on the odometry's clock, in order: where a step ends too
  bool shares = false;  ///< motions by shares of travel and turning, whatever the calibration left open
  LengthsIn lengths = LengthsIn::sensor_metre;
};

/// Cuts the recording's increments at the stamps of its sightings (time_offset_s of the landmark sensor
/// applied) and composes what lies between: docs/theory/motion-and-sensor.md, eq. 1. Sightings outside the
/// odometry's time are left out and reported. Throws InputError when the robot has no landmark sensor;
/// CannotAnswer when the chassis cannot determine its motion.
[[nodiscard]] SlamInput slam_input(const Recording& recording, const Robot& robot,
                                   const SlamInputOptions& options = {});
/// The same with the recording's readings as someone corrected them (SlipReport::corrected).
[[nodiscard]] SlamInput slam_input(const Recording& recording, const AlignedReadings& readings,
                                   const Robot& robot, const SlamInputOptions& options = {});

}  // namespace trundle::slam
