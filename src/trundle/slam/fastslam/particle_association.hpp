#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "trundle/slam/association/association.hpp"
#include "trundle/slam/association/existence.hpp"
#include "trundle/slam/association/landmark_grid.hpp"
#include "trundle/slam/fastslam/choice_kernels.hpp"
#include "trundle/slam/fastslam/gating_sample.hpp"
#include "trundle/slam/fastslam/mutual_exclusion.hpp"
#include "trundle/slam/fastslam/particle_belief.hpp"
#include "trundle/slam/fastslam/particle_kernels.hpp"

namespace trundle::slam {

/// Sightings without names, for particles: each finds out for itself which landmark of its own map is which.
///
/// All particles share one pool of landmark columns; a particle has some of them. Those that take one
/// sighting for a new landmark get one column together. A sighting that all take for the same landmark is as
/// good as one with a name. For any other a column is made in which every particle finds the landmark that it
/// takes the sighting for: one that takes it for none finds a landmark there that may be anywhere, which says
/// nothing about its pose. docs/theory/association.md.
class ParticleAssociation {
 public:
  ParticleAssociation(const LandmarkSensor& sensor, std::size_t particles);

  /// Takes the observations of a step that have no name.
  void collect(std::span<const Observation> observations);
  [[nodiscard]] bool sees_something() const { return sightings_ > 0; }
  /// Which landmarks each may show, by the gating subset of this step: they are requested of the map for all
  /// particles.
  void find_candidates(ParticleBelief& belief, GatingSample& gating_sample);
  /// How a particle associates.
  struct Sampling {
    Matrix3 sensor_covariance;  ///< of a twist in the sensor's frame, about where its sensor stands
    Draw draw;                  ///< purposes from 1 on are free
  };
  /// A block of the particles draws its associations.
  void associate(const Sampling& sampling, ParticleSet& particles, ParticleRange block);
  /// Once all have: decides again where two sightings show a particle the same landmark, and adds a reading
  /// for all particles of each sighting that some particle associates with a landmark.
  void resolve(const Matrix3& sensor_covariance, const SensorColumns& sensors,
               std::vector<KnownReading>& readings);

  /// Once particles are drawn and weighed, of their weights before the step: puts the improved landmarks
  /// back, and removes those that ought to be seen and are not.
  void update_map(ParticleBelief& belief, GatingSample& gating_sample, StepReport& report);
  /// Adds new ones; after that there is nothing more to do in this step.
  void create(ParticleBelief& belief, GatingSample& gating_sample, StepReport& report);

  /// Whether a landmark without a name has been confirmed; those with a name need not be.
  [[nodiscard]] bool is_confirmed(LandmarkId landmark) const {
    const auto index = static_cast<std::size_t>(landmark);
    return index >= entries_.size() || !grid_.contains(index) ||
           entries_[index].existence.is_confirmed(visibility_);
  }

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.grid_, self.entries_, self.widest_m_, self.located_, self.visibility_);
  }

 private:
  /// One observation without a name.
  struct Sighting {
    std::size_t observation = 0;
    Observation seen = {};
    ReadingTerms reading = {};
    Vector2 place = Vector2::Zero();  ///< where the reporter sees it
    Hypotheses may_show = {};
    bool is_unanimous = false;
    bool is_mapped = false;                ///< some particle associates it with a landmark that it has
    Vector2 innovation = Vector2::Zero();  ///< of what is reported
    double nis = 0.0;

    /// Nothing where that landmark comes into question for no particle.
    [[nodiscard]] const Candidate* candidate(LandmarkId landmark) const {
      const auto at = std::ranges::find(may_show.candidates, landmark, &Candidate::landmark);
      return at == may_show.candidates.end() ? nullptr : &*at;
    }
    [[nodiscard]] double share_that_chose(std::int32_t choice, const Column<double>& weights) const {
      if (is_unanimous) return may_show.choices.front() == choice ? 1.0 : 0.0;
      return trundle::slam::share_that_chose(choice, may_show.choices, weights);
    }
  };
  /// Landmarks lie in the grid where the gating subset had them when they were last seen, and for all
  /// particles not further away than this.
  struct Entry {
    double slack_m = 0.0;
    Existence existence;

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.slack_m, self.existence);
    }
  };

  std::span<Sighting> sightings() { return {pool_.data(), sightings_}; }
  [[nodiscard]] std::span<const Sighting> sightings() const { return {pool_.data(), sightings_}; }
  void find_candidates(Sighting& sighting, ParticleBelief& belief, GatingSample& gating_sample);
  void locate(LandmarkId landmark, ParticleBelief& belief, GatingSample& gating_sample);
  void find_agreement(Sighting& sighting) const;
  void find_reported(Sighting& sighting, const SensorAt& sensor, const Matrix3& sensor_covariance) const;
  LandmarkColumns& associated_landmarks(std::size_t k);
  void scatter_associated(std::size_t k, ParticleSet& particles);
  LandmarkId create(const Sighting& sighting, ParticleBelief& belief, GatingSample& gating_sample);
  void update_existence(ParticleBelief& belief);
  [[nodiscard]] bool fits_one(LandmarkId landmark, const SensorAt& sensor) const;
  [[nodiscard]] double share_that_saw(LandmarkId landmark, const Column<double>& weights) const;

  LandmarkSensor sensor_;
  std::size_t particles_;
  AssociationOptions options_;
  LandmarkGrid grid_;
  std::vector<Entry> entries_;  ///< by landmark
  double widest_m_ = 0.0;       ///< no slack is greater
  std::size_t located_ = 0;     ///< landmarks, since that was found out
  Visibility visibility_;
  // Of one step.
  std::vector<Sighting> pool_;
  std::size_t sightings_ = 0;
  std::size_t reporter_ = 0;  ///< the most probable particle before it: its associations are reported
  Pose2 best_sensor_;         ///< of the most probable one once weighed: it decides what ought to be seen
  MutualExclusion exclusion_;
  std::vector<TripleColumns> chances_;       ///< for three sightings each
  std::vector<LandmarkColumns> associated_;  ///< for each sighting, what each particle associates it with
};

}  // namespace trundle::slam
