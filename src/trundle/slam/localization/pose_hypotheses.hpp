#pragma once

#include <span>
#include <vector>

#include "trundle/io/archive.hpp"
#include "trundle/slam/localization/global_search.hpp"
#include "trundle/slam/localization/pose_ekf.hpp"

namespace trundle::slam {

/// A pose where the robot might be, followed as if it were there.
struct TrackedHypothesis {
  PoseEkf filter;
  double log_odds = 0.0;  ///< of all it has seen, against 'nothing of this is in the map'
  double alarm = 0.0;     ///< how much of late speaks against it: docs/theory/global-localization.md, eq. 53
};

/// Poses that are not out of the question, each followed by a filter of its own and judged by all that is
/// seen. At most kMostHypotheses, no two of them in the same place. docs/theory/global-localization.md,
/// eq. 55.
class PoseHypotheses {
 public:
  /// The map must outlive them.
  PoseHypotheses(const KnownMap& map, const LandmarkSensor& sensor, const MapSightOptions& options);

  void step(const Motion& motion, std::span<const Observation> observations, std::span<const double> novelty);
  void read_bias(const BiasReading& reading);
  /// What explains the last sightings, and nobody is there yet; `odometry` tells of its systematic errors.
  void admit(std::span<const PoseHypothesis> hypotheses, double log_prior, const PoseEstimate& odometry);
  void add(TrackedHypothesis hypothesis);
  /// Takes the most probable one out of them.
  TrackedHypothesis take_first();
  /// Those that have less in their favour, or as much against them.
  void remove(double least_log_odds, double alarm);
  /// Who is in that place.
  void remove(const Pose2& place);

  [[nodiscard]] std::span<const TrackedHypothesis> all() const {
    return hypotheses_;
  }  ///< the most probable first

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    std::size_t count = self.hypotheses_.size();
    archive(count);
    if constexpr (Archive::kReads) {
      if (count > kMostHypotheses) throw DamagedState();
      self.hypotheses_.assign(count, {PoseEkf(*self.map_, self.sensor_, {}, self.options_)});
    }
    for (auto& hypothesis : self.hypotheses_)
      archive(hypothesis.filter, hypothesis.log_odds, hypothesis.alarm);
  }

 private:
  void sort();

  const KnownMap* map_;
  LandmarkSensor sensor_;
  MapSightOptions options_;
  std::vector<TrackedHypothesis> hypotheses_;
};

}  // namespace trundle::slam
