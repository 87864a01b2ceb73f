#pragma once

#include <limits>
#include <span>
#include <vector>

#include "trundle/slam/association/association.hpp"
#include "trundle/slam/association/existence.hpp"
#include "trundle/slam/association/landmark_grid.hpp"
#include "trundle/slam/ekf/agreement.hpp"
#include "trundle/slam/ekf/joint_compatibility.hpp"
#include "trundle/slam/ekf/joint_gaussian.hpp"

namespace trundle {

struct EkfSlamOptions {
  SlamPrior prior = {};
  double gate = kDefaultGate;  ///< a sighting whose squared innovation is above is rejected
  UnknownIdOptions unknown = {};
  LandmarkId first_nameless = 0;  ///< landmarks without names are numbered from here on: above all names
};

/// Pose, systematic errors of the odometry and landmarks as one Gaussian: JointGaussian, with all sightings
/// of a step in one update. Equations: docs/theory/ekf.md.
class EkfSlam {
 public:
  EkfSlam(const LandmarkSensor& sensor, const EkfSlamOptions& options);

  const StepReport& step(const Motion& motion, std::span<const Observation> observations);
  /// What the gyro reads at rest, after a step.
  void read_bias(const BiasReading& reading);

  PoseEstimate estimate() const { return state_.body(); }
  std::size_t landmarks() const { return entries_.size(); }
  MappedLandmark landmark(std::size_t index) const;
  /// Whether its map has it.
  bool has_landmark(std::size_t) const { return true; }
  /// Whether it surely exists: one without a name may be tentative.
  bool is_confirmed(std::size_t index) const {
    return entries_[index].has_name || entries_[index].existence.is_confirmed(visibility_);
  }
  /// The whole joint covariance, in the order x, y, heading, s, x_1, y_1, ...
  Eigen::MatrixXd covariance() const { return state_.covariance(); }

  /// Of some landmarks, x and y of each.
  Eigen::MatrixXd map_covariance(std::span<const std::size_t> landmarks) const;

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.state_, self.entries_, self.index_of_, self.next_nameless_, self.grid_, self.off_grid_m_,
            self.visibility_, self.report_);
  }

 private:
  using Index = Eigen::Index;
  static constexpr std::int64_t kNone = -1;  ///< in place of a landmark's number
  /// An observation of a landmark that the map has.
  struct Match {
    std::size_t observation;
    std::size_t landmark;
    Vector2 innovation;
  };

  /// What comes nearest to one without a name.
  struct Nearest {
    Vector2 innovation = Vector2::Zero();
    double nis = std::numeric_limits<double>::infinity();
    bool is_doubtful = false;  ///< whether it shows a landmark of the map: neither that nor a new one
  };

  /// A landmark.
  struct Entry {
    LandmarkId id;
    std::size_t sightings;
    bool has_name;  ///< given by the caller: it exists
    Existence existence;

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.id, self.sightings, self.has_name, self.existence);
    }
  };

  void predict(const Motion& motion);
  void recognise();
  void find_candidates();
  void pair_up();
  void pair(std::size_t nameless, std::size_t landmark);
  void doubt_the_left_over(const JointExplanation& explanation, double none);
  void decide(const JointExplanation& explanation);
  void match_open();
  void covary();
  void keep_gated();
  void doubt_the_pose(const Pose2& motion);
  SeenAndMapped seen_and_mapped(const Match& match) const;
  void update_matched();
  void add_landmark(std::size_t observation);
  void look_around();
  void remove(std::size_t landmark);
  void locate_again();
  std::int64_t find(LandmarkId name) const;
  std::int64_t shown_by(std::size_t observation) const;
  void call(std::size_t landmark, LandmarkId name);

  LandmarkSensor sensor_;
  Matrix2 R_;
  EkfSlamOptions options_;
  std::vector<double> joint_limits_;
  JointGaussian state_;
  std::vector<Entry> entries_;
  std::vector<std::int64_t> index_of_;  ///< by name; kNone: not in the map
  LandmarkId next_nameless_;
  LandmarkGrid grid_;        ///< of landmarks without names
  double off_grid_m_ = 0.0;  ///< so far have landmarks moved since all were put there
  Visibility visibility_;
  StepReport report_;
  // Of one step; kept so that steps with names allocate nothing.
  std::span<const Observation> observations_;
  std::vector<std::int64_t> taken_for_;  ///< by observation without a name: a landmark; kNone: of none
  std::vector<std::size_t> open_;        ///< observations without a landmark yet
  std::vector<std::size_t> seen_;        ///< landmarks
  std::vector<Match> matches_;
  std::vector<double> nis_;             ///< of the matches
  std::vector<SeenAndMapped> at_odds_;  ///< matches beyond the gate
  std::vector<JointGaussian::Rows> H_;
  Strips PHt_;
  Eigen::MatrixXd S_;
  Eigen::VectorXd innovation_;
  // Of the sightings without names.
  std::vector<std::size_t> nameless_;
  std::vector<std::vector<std::size_t>> candidates_;
  std::vector<Nearest> nearest_;
  JointReadings readings_;
};

}  // namespace trundle
