#pragma once

#include <span>
#include <vector>

#include "trundle/slam/ekf/packed_panels.hpp"
#include "trundle/slam/report.hpp"

namespace trundle::slam {

/// The body (pose and systematic errors) and all landmarks of a map as one Gaussian.
///
/// What is near the robot is active: its mean and covariance are those of now. What the rest of the map
/// learns from the sightings of active landmarks goes through its covariance with them, and is written down
/// in matrices of the size of the active part, until many landmarks have become active and all is settled at
/// once. That is exact, whatever is active when. docs/theory/ekf.md, eq. 7.
class JointGaussian {
 public:
  using Index = Eigen::Index;
  /// Where the systematic errors begin: after the pose.
  static constexpr Index kPose = 3;

  explicit JointGaussian(const SlamPrior& prior);

  [[nodiscard]] std::size_t landmarks() const { return active_of_.size(); }
  [[nodiscard]] Pose2 pose() const { return {mean_[0], mean_[1], mean_[2]}; }
  [[nodiscard]] PoseEstimate body() const;
  [[nodiscard]] Vector2 landmark(std::size_t landmark) const;
  [[nodiscard]] Matrix2 landmark_covariance(std::size_t landmark) const;
  /// Of the body and all landmarks.
  [[nodiscard]] Eigen::MatrixXd covariance() const;

  /// Brings landmarks into the active part.
  void activate(std::span<const std::size_t> landmarks);
  /// Where an active landmark is in the active part.
  [[nodiscard]] Index index_of(std::size_t landmark) const { return active_of_[landmark]; }
  [[nodiscard]] bool is_active(std::size_t landmark) const { return active_of_[landmark] >= 0; }
  /// Mean of an active landmark.
  [[nodiscard]] Vector2 active(Index at) const { return mean_.segment<2>(at); }
  /// Rows of the active part.
  [[nodiscard]] Index size() const { return size_; }

  [[nodiscard]] Index systematic() const { return body_ - kPose; }

  /// The body's next pose, its derivatives by the pose before (F) and by the systematic errors (W), and
  /// noise; the variance by which the first of those walks meanwhile, and its covariance with the noise.
  struct Prediction {
    Pose2 pose;
    Matrix3 F;
    BySystematic W;
    Matrix3 noise;
    double walk = 0.0;
    Vector3 with_walk = Vector3::Zero();
  };
  void predict(const Prediction& prediction);
  /// A reading of the first of the systematic errors.
  void read_systematic(double value, double variance);

  /// Two rows of H: a reading of an active landmark.
  struct Rows {
    Index at;
    Matrix23 by_pose;
    Matrix2 by_landmark;
  };
  /// H P Hᵀ of one reading.
  [[nodiscard]] Matrix2 projected_covariance(const Rows& H) const;
  /// P Hᵀ of the active part.
  void cross_covariance(std::span<const Rows> H, PackedPanels& PHt) const;
  /// H P Hᵀ.
  void projected_covariance(std::span<const Rows> H, const PackedPanels& PHt, Eigen::MatrixXd& S) const;
  /// The Kalman update with readings whose innovation's covariance is S. Uses PHt up.
  void update(std::span<const Rows> H, PackedPanels& PHt, const Eigen::MatrixXd& S,
              Eigen::VectorXd& innovation);

  /// Adds an active landmark: its place, derivative by the pose, and the covariance of the reading.
  void append(const Vector2& place, const Matrix23& by_pose, const Matrix2& noise);
  /// The last landmark takes the number of the removed one.
  void remove(std::size_t landmark);

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.size_, self.mean_, self.A_, self.transfer_, self.learned_, self.learned_mean_,
            self.settled_of_, self.active_of_, self.settled_mean_, self.P_);
  }

 private:
  [[nodiscard]] Index total() const { return body_ + 2 * static_cast<Index>(landmarks()); }
  [[nodiscard]] bool all_active() const { return size_ == total(); }
  [[nodiscard]] Eigen::MatrixXd settled_with_active(Index row, Index rows) const;
  void settle();
  void settle_passive();
  void grow_active(Index size);
  void grow_settled(Index size);

  Index body_;  ///< pose and systematic errors
  // The active part.
  Index size_;
  Eigen::VectorXd mean_;
  Eigen::MatrixXd A_;              ///< covariance, both triangles
  Eigen::MatrixXd transfer_;       ///< P_BA = P0_BA · transfer
  Eigen::MatrixXd learned_;        ///< P_BB = P0_BB + P0_BA · learned · P0_AB
  Eigen::VectorXd learned_mean_;   ///< mean_B = mean0_B + P0_BA · learned_mean
  std::vector<Index> settled_of_;  ///< row in the settled part, of each active row
  std::vector<Index> active_of_;   ///< by landmark; −1: passive
  // All, as they were last settled: P0. The lower triangle counts.
  Eigen::VectorXd settled_mean_;
  Eigen::MatrixXd P_;
  // Room to work in.
  mutable std::vector<PackedPanels::Sum> sums_;
  Eigen::MatrixXd root_;
  PackedPanels W_;
};

}  // namespace trundle::slam
