#pragma once

#include <array>
#include <cstdint>

#include "trundle/slam/fastslam/columns.hpp"
#include "trundle/slam/models/pending_motion.hpp"

namespace trundle::slam {

// What is done to every particle in one step, whatever it sees: many at once, with the best instruction set
// of the machine, and with the same bits on all.

/// Which random numbers: they depend on seed, step, purpose and particle, and on nothing else. [Salmon et al.
/// 2011, Threefry-4x32-20]
struct Draw {
  std::uint64_t seed = 0;
  std::uint64_t step = 0;
  std::uint32_t purpose = 0;
};
/// Standard normal numbers, three for each particle. [Box & Muller 1958], to ±5.7 σ.
void draw_normals(const Draw& draw, ParticleRange range, TripleColumns& n);
/// Uniform in (0, 1).
void draw_uniforms(const Draw& draw, ParticleRange range, TripleColumns& u);
/// Of the middle of one of 1024 pieces of (0, 1): nine for each particle, where so much will do.
void draw_chances(const Draw& draw, ParticleRange range, std::array<TripleColumns, 3>& chances);
/// The generator itself: the four words of one counter.
[[nodiscard]] std::array<std::uint32_t, 4> threefry(const std::array<std::uint32_t, 4>& counter,
                                                    const std::array<std::uint32_t, 4>& key);

/// predicted = pose · M · exp(S s + offset), each particle with its own s. docs/theory/fastslam.md, eq. 9.
void predict(const PoseColumns& poses, const SystematicColumns& systematic, const PredictedMotion& motion,
             ParticleRange range, PoseColumns& predicted);

/// pose = predicted · exp(L n), L lower triangular, and the sensor there, from sensors.origin.
struct Placement {
  Matrix3 L = Matrix3::Zero();
  Pose2 body_from_sensor;
};
void place(const PoseColumns& predicted, const TripleColumns& n, const Placement& placement,
           ParticleRange range, PoseColumns& poses, SensorColumns& sensors);

/// log w less the greatest, w = exp(log w) over their sum, and 1/Σw². What is no number counts as −∞; 0 where
/// all are. Sums are those of kParticleLanes columns side by side, on every machine.
double normalise(ParticleRange range, double* log_weights, double* weights);

}  // namespace trundle::slam
