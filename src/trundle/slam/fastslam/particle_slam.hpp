#pragma once

#include <span>
#include <vector>

#include "trundle/slam/fastslam/gating_sample.hpp"
#include "trundle/slam/fastslam/particle_association.hpp"
#include "trundle/slam/fastslam/particle_belief.hpp"
#include "trundle/slam/fastslam/particle_kernels.hpp"
#include "trundle/slam/fastslam/proposal.hpp"
#include "trundle/slam/fastslam/thread_pool.hpp"

namespace trundle::slam {

/// Of a particle filter.
struct ParticleSlamOptions {
  Proposal proposal = Proposal::linearised;
  std::size_t particles = 100;
  std::uint64_t seed = 1;
  SlamPrior prior = {};
  double gate = kDefaultGate;   ///< a sighting is rejected when most particles find its NIS above
  double resample_below = 0.5;  ///< effective particles, as a share of all
  bool keep_paths = true;       ///< false: memory does not grow with time
  std::size_t threads = 1;      ///< results do not depend on it
  SwarmOptions swarm = {};
  PointEstimate estimate = PointEstimate::mean;
  LandmarkId first_unidentified =
      0;  ///< unidentified landmarks are numbered from here on: above all given ids
};

/// FastSLAM: a Rao–Blackwellised particle filter. Poses are drawn when there is something to draw them with.
/// Its covariance is the scatter of the particles: too small once all of them descend from one, as in any
/// such filter. Equations: docs/theory/fastslam.md.
class ParticleSlam {
 public:
  /// Throws InputError when there is no particle.
  ParticleSlam(const LandmarkSensor& sensor, const ParticleSlamOptions& options);

  /// One motion of the body and what was seen at its end: predict, gate, associate, propose, weigh, update,
  /// resample. What became of each observation, valid until the next step.
  const StepReport& step(const Motion& motion, std::span<const Observation> observations);
  /// What the gyro reads at rest, after a step.
  void read_bias(const BiasReading& reading);

  /// The particles' mean or best where the motion since they were last drawn has brought them, and the
  /// covariance about it of both. The best is that before a resampling.
  [[nodiscard]] PoseEstimate estimate() const;
  [[nodiscard]] std::size_t landmarks() const { return belief_.map.landmarks(); }
  /// Over all particles. The covariance is their scatter and the mean of their own.
  [[nodiscard]] MappedLandmark landmark(std::size_t index) const;
  /// Whether the most probable particle has it: of the unidentified ones not all have.
  [[nodiscard]] bool has_landmark(std::size_t index) const;
  /// Whether it surely exists: one without a name may be tentative.
  [[nodiscard]] bool is_confirmed(std::size_t index) const {
    return association_.is_confirmed(static_cast<LandmarkId>(index));
  }

  /// As they were last drawn: at the last step with sightings.
  [[nodiscard]] std::vector<Pose2> poses() const;
  /// Of each; they sum to 1.
  [[nodiscard]] std::vector<double> weights() const;
  /// Of the particle with the largest weight: poses after each step; empty when paths are not kept.
  [[nodiscard]] std::vector<Pose2> best_path() const;
  /// Of how many particles at the step with sightings so many before the last those of now descend; 1 where
  /// paths are not kept.
  [[nodiscard]] std::size_t ancestors(std::size_t steps_back) const {
    return belief_.paths.ancestors(steps_back, belief_.particles.ancestry);
  }
  /// Poses stored for that, by all particles together.
  [[nodiscard]] std::size_t stored_poses() const { return belief_.paths.stored(); }

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.draws_, self.resampling_, self.belief_, self.association_, self.report_);
  }

 private:
  /// A sighting of a landmark that is in the map, and no outlier.
  struct MatchedSighting {
    std::size_t observation;
    LandmarkId landmark;
    ReadingTerms reading;
  };
  /// What a step sees; room is kept from step to step.
  struct Sightings {
    std::vector<MatchedSighting> matched;
    std::vector<std::size_t> unmapped;   ///< valid observations of names that the map has not
    std::vector<KnownReading> readings;  ///< of those matched, by their names or without
    NearReadings near;                   ///< the same
  };

  void gate(std::span<const Observation> observations);
  [[nodiscard]] bool sees_something() const;
  void request_landmarks();
  void predict_and_associate(const Draw& draw, const Placement& by_motion);
  void propose_and_weigh(const PoseProposal::Step& proposal, ParticleRange block);
  void create_landmarks(std::span<const Observation> observations);
  void add_landmark(const Observation& observation, std::size_t index);
  void normalise_weights();
  void resample_if_poor();
  Draw next_draw() { return {options_.seed, draws_++, 0}; }

  LandmarkSensor sensor_;
  ParticleSlamOptions options_;
  ThreadPool thread_pool_;
  std::uint64_t draws_ = 0;  ///< so many numbers each particle has drawn
  ParticleBelief belief_;
  PoseProposal proposal_;
  SystematicResampling resampling_;
  GatingSample gating_sample_;
  ParticleAssociation association_;
  StepReport report_;
  Sightings seen_;
};

}  // namespace trundle::slam
