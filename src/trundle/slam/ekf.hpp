#pragma once

#include <span>
#include <vector>

#include "trundle/slam/association.hpp"
#include "trundle/slam/report.hpp"

namespace trundle {

struct EkfSlamOptions {
  SlamPrior prior = {};
  double gate = kDefaultGate;  ///< a sighting whose squared innovation is above is rejected
};

/// Pose, systematic errors of the odometry and landmarks as one Gaussian: mean (x, y, heading, s, x_1, y_1,
/// ...) and joint covariance, of which only the lower triangle is kept. All sightings of a step are one
/// update, so that each entry of the covariance is touched once. Equations: docs/slam.md.
class EkfSlam {
 public:
  EkfSlam(const LandmarkSensor& sensor, const EkfSlamOptions& options);

  const StepReport& step(const Motion& motion, std::span<const Observation> observations);

  PoseEstimate estimate() const;
  std::size_t landmarks() const { return ids_.size(); }
  MappedLandmark landmark(std::size_t index) const;
  /// The whole joint covariance.
  Eigen::MatrixXd covariance() const;

 private:
  using Index = Eigen::Index;
  /// An observation of a landmark that the map has.
  struct Match {
    std::size_t observation;
    Index at;  ///< of the landmark's x in the state
    ExpectedReading expected;
    Vector2 innovation;
  };

  Pose2 pose() const;
  void predict(const Motion& motion);
  std::vector<Observation> recognise(std::span<const Observation> observations);
  std::vector<Fit> fits_of(const Observation& observation) const;
  std::vector<Match> matches_of(std::span<const Observation> observations, std::vector<std::size_t>& open);
  void update(std::vector<Match> matches);
  Eigen::MatrixXd cross_covariance(const std::vector<Match>& matches) const;
  Eigen::MatrixXd innovation_covariance(const std::vector<Match>& matches, const Eigen::MatrixXd& PHt) const;
  void keep_gated(std::vector<Match>& matches, Eigen::MatrixXd& PHt, Eigen::MatrixXd& S);
  void add_landmark(const Observation& observation);
  void reserve(Index size);
  Index find(LandmarkId id) const;

  Pose2 body_from_sensor_;
  double max_range_m_;
  Matrix2 R_;
  double gate_;
  static constexpr Index kBody = 6;  ///< pose and systematic errors
  Index size_ = kBody;
  Eigen::VectorXd mean_;
  Eigen::MatrixXd P_;  ///< its first size_ rows and columns count, below the diagonal
  std::vector<LandmarkId> ids_;
  std::vector<std::size_t> sightings_;
  std::vector<Index> index_of_;  ///< by id; −1: not in the map
  StepReport report_;
};

}  // namespace trundle
