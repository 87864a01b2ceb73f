#pragma once

#include <span>
#include <vector>

#include "trundle/slam/localization/map_sight.hpp"

namespace trundle::slam {

/// What a step on a known map has found.
struct MapStepReport {
  std::vector<ObservationReport> observations;  ///< as they were given
  /// Log of how much better the readings fit somewhere else: docs/theory/localization.md, eq. 43.
  double against = 0.0;
  double new_evidence_against = 0.0;  ///< the same of what is new among them
  std::size_t particles = 0;          ///< that were weighed; 0: one Gaussian

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.observations, self.against, self.new_evidence_against, self.particles);
  }
};

/// Pose and systematic errors on a known map as one Gaussian. What is not known of the map stays unknown: its
/// correlation with the pose is carried along (Schmidt), so that a landmark seen a thousand times is not
/// taken for a thousand landmarks. Updates are iterated. docs/theory/localization.md, eq. 41 to 45.
class PoseEkf {
 public:
  /// The map must outlive the filter.
  PoseEkf(const KnownMap& map, const LandmarkSensor& sensor, const PoseEstimate& start,
          const MapSightOptions& options);

  /// A start that was made of landmarks of the map, as if their errors were independent: what is wrong with
  /// them is wrong with it. docs/theory/global-localization.md, eq. 47b.
  PoseEkf(const KnownMap& map, const LandmarkSensor& sensor, const PoseEstimate& start,
          const MapSightOptions& options, std::span<const LandmarkGain> made_of);

  /// `novelty`: how much of each observation is evidence for or against the pose, 0 to 1.
  const MapStepReport& step(const Motion& motion, std::span<const Observation> observations,
                            std::span<const double> novelty);

  /// Whether a step would be more than one Gaussian can say: the pose is more than one place, and a reading
  /// without a name shows one of several landmarks.
  [[nodiscard]] bool is_ambiguous(const Motion& motion, std::span<const Observation> observations) const;

  /// What the gyro reads at rest, after a step.
  void read_bias(const BiasReading& reading);

  [[nodiscard]] const PoseEstimate& estimate() const { return belief_; }

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.belief_, self.with_map_, self.report_);
  }

 private:
  struct Match {
    std::size_t observation;
    LandmarkId landmark;
    MapSight sight;
  };
  /// Of all matches together, two rows each.
  struct Gain {
    Eigen::MatrixXd G;  ///< the readings by the body
    Eigen::MatrixXd X;  ///< covariance of body and readings, by the map
    Eigen::MatrixXd W;  ///< covariance of the readings, were the body certain
    Eigen::MatrixXd K;
  };

  void predict(const Motion& motion);
  [[nodiscard]] MapSight sight_of(LandmarkId landmark, const Observation& observation) const;
  std::vector<Match> matches_of(std::span<const Observation> observations, std::span<const double> novelty);
  [[nodiscard]] Gain gain_of(const std::vector<Match>& matches) const;
  [[nodiscard]] std::vector<Match> linearised(std::vector<Match> matches,
                                              std::span<const Observation> observations,
                                              const Matrix3& F) const;
  [[nodiscard]] bool is_straight(const std::vector<Match>& before, const std::vector<Match>& now,
                                 const Vector3& moved) const;
  void update(std::vector<Match> matches, std::span<const Observation> observations);
  void update_covariance(const std::vector<Match>& matches, const Gain& gain);
  void follow(const Matrix3& F);

  const KnownMap* map_;
  LandmarkSensor sensor_;
  MapSightOptions options_;
  PoseEstimate belief_;
  Eigen::MatrixXd with_map_;  ///< pose and systematic errors by landmarks; empty: the map is exact
  MapStepReport report_;
};

}  // namespace trundle::slam
