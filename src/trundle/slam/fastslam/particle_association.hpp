#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "trundle/slam/association/association.hpp"
#include "trundle/slam/association/existence.hpp"
#include "trundle/slam/association/landmark_grid.hpp"
#include "trundle/slam/fastslam/ancestry.hpp"
#include "trundle/slam/fastslam/choice_kernels.hpp"
#include "trundle/slam/fastslam/gating_sample.hpp"
#include "trundle/slam/fastslam/mutual_exclusion.hpp"
#include "trundle/slam/fastslam/particle_kernels.hpp"
#include "trundle/slam/fastslam/particle_map.hpp"

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
  /// The particles as they are when they look, from `choose` on.
  struct View {
    const SensorColumns& sensors;
    Matrix3 sensor_covariance;  ///< of a twist in the sensor's frame, beyond that
    std::size_t reporter;       ///< whose decisions are reported
    Draw draw;                  ///< purposes from 1 on are free
    double* log_weights;
    GatingSample& gating_sample;  ///< of this step; it says which landmarks are candidates
  };
  /// What each particle takes them for: which landmarks come into question, and are requested of the map for
  /// all particles; what some particles choose; and what becomes of all choices together.
  void look_up(const View& view, ParticleMap& map, Ancestry& ancestry);
  void choose(const View& view, ParticleRange range);
  void decide(const View& view);
  /// Readings for all particles, of the sightings that some particle takes for a landmark it has.
  void add_readings(std::vector<KnownReading>& readings);

  /// What is left to do once particles are drawn and weighed.
  struct Drawn {
    const SensorColumns& sensors;
    Pose2 sensor_of_reporter;
    double* log_weights;
    const Column<double>& weights;  ///< those before the step
    GatingSample& gating_sample;
  };
  /// Puts the improved landmarks back, and removes those that ought to be seen and are not.
  void update_map(const Drawn& drawn, ParticleMap& map, Ancestry& ancestry, StepReport& report);
  /// Adds new ones; after that there is nothing more to do in this step.
  void create(const Drawn& drawn, ParticleMap& map, Ancestry& ancestry, StepReport& report);

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
    bool is_known = false;  ///< some particle takes it for a landmark that it has
    Vector2 innovation = Vector2::Zero();
    double nis = 0.0;  ///< of what is reported

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
  void look_up(Sighting& sighting, const View& view, ParticleMap& map, Ancestry& ancestry);
  void locate(LandmarkId landmark, ParticleMap& map, const Ancestry& ancestry, GatingSample& gating_sample);
  void prepare(std::size_t k, const View& view);
  void put_back(std::size_t k, const Drawn& drawn);
  LandmarkId create(const Sighting& sighting, const Drawn& drawn, ParticleMap& map, Ancestry& ancestry);
  void update_existence(const Drawn& drawn, ParticleMap& map, Ancestry& ancestry);
  [[nodiscard]] bool fits_one(LandmarkId landmark, const Drawn& drawn) const;
  [[nodiscard]] double share_that_saw(LandmarkId landmark, const Column<double>& weights) const;

  LandmarkSensor sensor_;
  std::size_t particles_;
  AssociationOptions options_;
  std::size_t reporter_ = 0;
  LandmarkGrid grid_;
  std::vector<Entry> entries_;  ///< by landmark
  double widest_m_ = 0.0;       ///< no slack is greater
  std::size_t located_ = 0;     ///< landmarks, since that was found out
  Visibility visibility_;
  // Of one step.
  std::vector<Sighting> pool_;
  std::size_t sightings_ = 0;
  MutualExclusion exclusion_;
  std::vector<TripleColumns> chances_;      ///< for three sightings each
  std::vector<LandmarkColumns> taken_for_;  ///< for each sighting, what each particle takes it for
};

}  // namespace trundle::slam
