#pragma once

#include <array>
#include <span>
#include <vector>

#include "trundle/calibration/run.hpp"
#include "trundle/chassis/rows.hpp"
#include "trundle/odometry/rolling.hpp"

namespace trundle {

/// A stretch of a run between two poses of the reference.
struct NoisePiece {
  const Run* run = nullptr;
  std::size_t first = 0;  ///< increments
  std::size_t last = 0;
  Vector3 motion =
      Vector3::Zero();  ///< of the body by the reference, in the frame of its start: x, y, heading
  /// Pᵀ z of the summed readings: what no motion explains. Empty where they have no such part, or no gyro.
  Eigen::VectorXd contradiction;
  Increment rolled;  ///< |turned| summed, and the duration: what the readings' noise grows with
  Rolling rolling;   ///< at the mean speed: the piece is cut out of a drive
};

/// From each place of a run to the last one that is at most `piece_s` later, and on from there.
std::vector<NoisePiece> noise_pieces(std::span<const Run> runs, const Robot& robot, double piece_s);

/// The levels of noise that pieces are judged by.
struct NoiseLevels {
  double wheel = 0.0;     ///< typical of the wheels [m/√m]
  double sideways = 0.0;  ///< lateral, or skid [m/√m]
  double gyro = 0.0;      ///< [rad/s/√Hz]
  double position = 0.0;  ///< of each reference pose [m]
  double heading = 0.0;   ///< [rad]
  /// Of each wheel's noise, over `wheel`; their mean square is 1.
  std::array<double, kMaxWheels> share = all_alike();

  static constexpr std::array<double, kMaxWheels> all_alike() {
    std::array<double, kMaxWheels> share{};
    share.fill(1.0);
    return share;
  }
  bool alike() const { return share == all_alike(); }
};

Robot with_levels(const Robot& robot, const NoiseLevels& levels);
/// Whether anything is assumed of sideways motion.
bool has_sideways(const Robot& robot);

/// −2 log likelihood of what odometry misses of the pieces. docs/theory/calibration-noise.md, eq. 9.
double surprise_of_misses(std::span<const NoisePiece> pieces, const Robot& robot, const NoiseLevels& levels);
/// The same of what no motion explains: it tells the sensors' levels from each other, and how large they are
/// at least. docs/theory/calibration-noise.md, eq. 10.
double surprise_of_contradictions(std::span<const NoisePiece> pieces, const Robot& robot,
                                  const NoiseLevels& levels);
/// Share of the pieces whose position error lies inside its 95 % ellipse.
double share_inside(std::span<const NoisePiece> pieces, const Robot& robot, const NoiseLevels& levels);

}  // namespace trundle
