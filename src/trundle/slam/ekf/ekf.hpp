#pragma once

#include <span>
#include <vector>

#include "trundle/slam/association/association.hpp"
#include "trundle/slam/association/landmark_table.hpp"
#include "trundle/slam/association/unidentified.hpp"
#include "trundle/slam/ekf/joint_gaussian.hpp"

namespace trundle::slam {

/// Of the EKF.
struct EkfSlamOptions {
  SlamPrior prior = {};
  double gate = kDefaultGate;  ///< a sighting whose NIS is above is rejected
  LandmarkId first_unidentified =
      0;  ///< unidentified landmarks are numbered from here on: above all given ids
};

/// Observations of landmarks of the map, stacked: one update of the joint Gaussian.
struct EkfMatches {
  struct Match {
    std::size_t observation;
    std::size_t landmark;
    Vector2 innovation;  ///< (range, bearing) [m, rad]
  };
  std::vector<Match> matches;
  std::vector<JointGaussian::Rows> H;  ///< two rows of each match
  PackedPanels PHt;                    ///< P Hᵀ of the active part
  Eigen::MatrixXd S;                   ///< H P Hᵀ + R
  Eigen::VectorXd innovation;          ///< of all matches
};

/// Pose, systematic errors of the odometry and landmarks as one Gaussian: JointGaussian, with all sightings
/// of a step in one update. Equations: docs/theory/ekf.md.
class EkfSlam {
 public:
  EkfSlam(const LandmarkSensor& sensor, const EkfSlamOptions& options);

  /// One motion of the body and what was seen at its end; what became of each observation, valid until the
  /// next step.
  const StepReport& step(const Motion& motion, std::span<const Observation> observations);
  /// What the gyro reads at rest, after a step.
  void read_bias(const BiasReading& reading);

  /// Of now, in the world.
  [[nodiscard]] PoseEstimate estimate() const { return joint_.body(); }
  [[nodiscard]] std::size_t landmarks() const { return table_.size(); }
  [[nodiscard]] MappedLandmark landmark(std::size_t index) const;
  /// Whether its map has it.
  [[nodiscard]] bool has_landmark(std::size_t) const { return true; }
  /// Whether it surely exists: an unidentified one may be tentative.
  [[nodiscard]] bool is_confirmed(std::size_t index) const {
    return table_.is_confirmed(static_cast<int>(index));
  }
  /// The whole joint covariance, in the order x, y, heading, systematic errors, x_1, y_1, ...
  [[nodiscard]] Eigen::MatrixXd covariance() const { return joint_.covariance(); }
  /// Of some landmarks, x and y of each [m²].
  [[nodiscard]] Eigen::MatrixXd map_covariance(std::span<const std::size_t> landmarks) const;

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.joint_, self.table_, self.report_);
  }

 private:
  using Index = Eigen::Index;

  void predict(const Motion& motion);
  void associate();
  bool match();
  void gate();
  void update();
  void augment();
  int add_landmark(const Observation& observation);
  void update_existence();

  void associate_unidentified();
  std::vector<std::vector<std::size_t>> find_candidates();
  void pair(std::size_t sighting, std::size_t landmark);

  void set_innovation_covariance();
  void refresh_grid();
  [[nodiscard]] int landmark_of(std::size_t observation) const;

  LandmarkSensor sensor_;
  Matrix2 R_;  ///< of (range, bearing)
  EkfSlamOptions options_;
  JointGaussian joint_;
  LandmarkTable table_;  ///< of its landmarks
  StepReport report_;
  // Of one step; kept so that steps with ids allocate nothing.
  std::span<const Observation> observations_;
  std::vector<std::size_t> open_;     ///< observations that have neither updated nor created a landmark
  std::vector<std::size_t> in_view_;  ///< landmarks
  EkfMatches stacked_;
  UnidentifiedSightings unidentified_;
};

}  // namespace trundle::slam
