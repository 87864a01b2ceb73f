#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "trundle/slam/smoothing/solver/elimination_tree.hpp"
#include "trundle/slam/smoothing/solver/marginal_prior.hpp"
#include "trundle/slam/smoothing/solver/smoothing_problem.hpp"

namespace trundle::slam {

struct FactorGraphOptions {
  Eigen::VectorXd parameter_sigma = {};   ///< 1σ of each parameter's prior, about 0
  std::optional<double> bias_sigma = {};  ///< of the bias that walks beside the poses; nothing: there is none
  double gate = 0.0;                      ///< as of SmoothingProblem
  int most_rounds = 10;  ///< linearisations in one settle(); what is left is done in the next one
};

/// A smoothing problem that grows and shrinks, solved as it does: poses, landmarks and parameters are
/// variables; motions, sightings, readings of the bias and what was marginalised are factors, linearised
/// where their variables were when that last mattered. Landmarks have numbers here, no names: which of them a
/// sighting shows is decided elsewhere. docs/theory/online-smoother.md, eq. 23; marginalisation.md.
class FactorGraph {
 public:
  FactorGraph(const LandmarkSensor& sensor, const FactorGraphOptions& options);

  /// The pose that follows, `link.to`, stands at `now` by what is known before this.
  void add_pose(const Pose2& now, MotionLink link);
  /// Its number: where a sighting from the last pose shows it.
  int add_landmark(const Observation& observation);
  /// From the last pose.
  void add_sighting(int landmark, const Observation& observation);
  /// At the last pose.
  void add_bias_reading(double rad_s, double variance);
  /// With what showed it since the last marginalisation; the last landmark takes its number.
  void remove_landmark(int landmark);
  /// What showed `gone` shows `kept`; `gone` is to be removed then.
  void merge_landmarks(int kept, int gone);
  /// The next sightings are those of another keyframe.
  void clear_view() { in_view_.clear(); }

  /// Gauss–Newton, where anything has moved by more than what is linear. `on_solved`: each landmark that was
  /// solved for, in each round. Throws CannotAnswer where something is left undetermined.
  void settle(const std::function<void(int landmark)>& on_solved);
  /// The first poses become a prior of what is left, linearised as they are now, for good. Eq. 33 to 35.
  void marginalise_first(int poses);

  /// Of poses in the window alone; what was marginalised is no part of it.
  [[nodiscard]] const SmoothingProblem& problem() const { return problem_; }
  /// Its solution so far.
  [[nodiscard]] SmoothingState state() const;
  /// Whether anything was.
  [[nodiscard]] bool has_marginalised() const { return !priors_.empty(); }
  [[nodiscard]] const LandmarkSensor& sensor() const { return problem_.sensors.front(); }
  [[nodiscard]] int poses() const { return problem_.poses; }
  [[nodiscard]] int landmarks() const { return problem_.landmarks; }
  [[nodiscard]] Pose2 pose_at(int pose) const;
  [[nodiscard]] Pose2 last_pose() const { return pose_at(problem_.poses - 1); }
  /// At the last pose; 0 before there is one.
  [[nodiscard]] double last_bias() const;
  [[nodiscard]] Eigen::VectorXd parameters() const;
  [[nodiscard]] Vector2 landmark_at(int landmark) const;

  /// Variables, for covariance(): two numbers of a landmark; three of a pose, with the bias four.
  [[nodiscard]] int landmark_variable(int landmark) const;
  [[nodiscard]] int last_pose_variable() const { return pose_variables_.back(); }
  [[nodiscard]] int parameter_variable() const { return parameter_variable_; }  ///< −1: none
  /// Variables of landmarks that the last keyframe with sightings shows.
  [[nodiscard]] std::span<const int> in_view() const { return in_view_; }
  [[nodiscard]] int landmark_of_variable(int variable) const;
  /// Of numbers that depend on variables so.
  [[nodiscard]] Eigen::MatrixXd covariance(std::span<const EliminationTree::Derivative> derivatives,
                                           Eigen::Index numbers) const {
    return tree_.projected_covariance(derivatives, numbers);
  }
  [[nodiscard]] Matrix2 landmark_covariance(int landmark) const;
  /// Of some landmarks, x and y of each [m²]: as costly as smoothing all of it once. Empty without landmarks.
  [[nodiscard]] Eigen::MatrixXd map_covariance(std::span<const std::size_t> landmarks) const;

  /// Poses that a landmark was seen from, ascending; those that were marginalised are left out.
  [[nodiscard]] std::vector<int> poses_that_see(int landmark) const;

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.problem_.poses, self.problem_.landmarks, self.problem_.motions, self.problem_.sightings,
            self.problem_.bias_readings, self.at_, self.tree_, self.factors_, self.variables_,
            self.pose_variables_, self.first_seen_, self.factor_of_, self.landmarks_, self.priors_,
            self.in_view_);
  }

 private:
  /// What a variable of the tree is.
  struct Variable {
    enum class Kind { pose, landmark, parameters, removed } kind;
    int index;

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.kind, self.index);
    }
  };
  /// A part of the problem, which is a term of the tree.
  struct Factor {
    enum class Kind { motion, sighting, bias, parameters, prior } kind;
    std::size_t index;

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.kind, self.index);
    }
  };
  struct Landmark {
    int variable = -1;
    int seen_from = -1;  ///< the last pose; below 0: as many before the first one
    std::vector<std::size_t> sightings = {};

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.variable, self.seen_from, self.sightings);
    }
  };
  /// A part of what was marginalised. The first knows the first pose, the others are submaps.
  struct Prior {
    MarginalPrior prior;
    int factor = -1;

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.prior, self.factor);
    }
  };
  /// Moves within which sightings are linear.
  struct LinearMoves {
    double turn_rad;
    double way_m;
  };
  /// How far a landmark has moved against a pose since both were linearised [m], and what of a reading that
  /// leaves out, as a share of its sigma.
  struct Apart {
    Vector2 moved;
    double left_out;
  };
  struct Equations;

  static LinearMoves linear_moves(const LandmarkSensor& sensor);
  int add_variable(const Variable& variable, const Eigen::VectorXd& tolerance);
  int add_factor(const Factor& factor, std::span<const int> variables);
  void remove_sighting(std::size_t sighting);
  [[nodiscard]] Pose2 linearisation_of(const Pose2& now) const;
  void linearise(int factor, const SmoothingState& at, FrontSystem& system) const;
  bool relinearise(std::span<const int> solved);
  bool relinearise_all();
  void move_linearisation(int variable, const Eigen::VectorXd& by);
  [[nodiscard]] bool has_moved_alone(int pose) const;
  [[nodiscard]] Vector2 sight_of(int landmark, int pose) const;
  [[nodiscard]] Apart moved_apart(int landmark, int pose) const;
  /// Of a reading, as a share of its sigma, where a landmark has moved by `apart` against the pose. Eq. 23.
  [[nodiscard]] double left_out(const Vector2& apart, const Vector2& sight) const;
  [[nodiscard]] double bias_at(int pose) const;
  [[nodiscard]] Eigen::VectorXd value_of(int variable, const SmoothingState& state) const;

  [[nodiscard]] MarginalPrior::Unknown prior_unknown(int variable, const SmoothingState& state) const;
  [[nodiscard]] MarginalPrior::NextPose next_pose(const MotionLink& link, const SmoothingState& state) const;
  void forget_poses(int poses);
  void forget_sightings(int poses);
  void split_off_submap();
  void add_submap(MarginalPrior submap);
  void set_prior(std::size_t which, MarginalPrior prior);

  FactorGraphOptions options_;
  LinearMoves linear_;
  SmoothingProblem problem_;
  SmoothingState at_;                ///< where its factors are linearised
  EliminationTree tree_;             ///< of moves from there
  std::vector<Variable> variables_;  ///< by variable of the tree
  std::vector<Factor> factors_;      ///< by term of the tree
  int parameter_variable_ = -1;
  std::vector<int> pose_variables_;  ///< by pose
  std::vector<int> first_seen_;      ///< by pose: a landmark; −1: none
  std::vector<int> factor_of_;       ///< by sighting
  std::vector<Landmark> landmarks_;
  std::vector<Prior> priors_;
  std::vector<int> in_view_;
};

}  // namespace trundle::slam
