#pragma once

#include <map>
#include <optional>
#include <span>
#include <vector>

#include "trundle/geometry/trajectory.hpp"
#include "trundle/slam/association/unidentified.hpp"
#include "trundle/slam/report.hpp"
#include "trundle/slam/smoothing/elimination_tree.hpp"
#include "trundle/slam/smoothing/marginal_prior.hpp"
#include "trundle/slam/smoothing/smoothing_problem.hpp"

namespace trundle::slam {

/// Of the smoother that goes along.
struct IncrementalSmootherOptions {
  SlamPrior prior = {};
  bool has_bias = false;       ///< the first of the systematic errors walks: the gyro's bias
  double gate = kDefaultGate;  ///< NIS beyond which a sighting has less weight than its square: an outlier
  int most_rounds = 10;        ///< linearisations in one step; what is left is done in the next one
  /// How long poses stay unknowns [s]: older ones are marginalised, so that neither memory nor the time of a
  /// step grow as it drives on. Nothing: always.
  std::optional<double> window_s = {};
  UnknownIdOptions unknown = {};
  LandmarkId first_unidentified =
      0;  ///< unidentified landmarks are numbered from here on: above all given ids
};

/// All poses, landmarks and systematic errors by nonlinear least squares, as it drives: after each step the
/// estimate is that of the batch (smoother.hpp) over everything so far. A step costs what is in view; closing
/// a loop costs the loop, once. Equations: docs/theory/online-smoother.md.
class IncrementalSmoother {
 public:
  IncrementalSmoother(const LandmarkSensor& sensor, const IncrementalSmootherOptions& options);

  /// One motion and what was seen at its end. Sightings without an id show what explains all of them best;
  /// landmarks that turn out to be one become one. The stamp is for the window alone.
  const StepReport& step(const Motion& motion, std::span<const Observation> observations,
                         double time_s = 0.0);
  /// What the gyro reads at rest, after a step.
  void read_bias(const BiasReading& reading);

  /// Of now, in the world, given everything so far.
  [[nodiscard]] PoseEstimate estimate() const { return estimate_after(since_); }
  /// The same after a further motion, of which no step is made.
  [[nodiscard]] PoseEstimate estimate_after(const Motion& motion) const {
    return estimate_after(moved_on(motion));
  }
  /// Where it was at its keyframes, with their stamps; of those in the window.
  [[nodiscard]] std::vector<StampedPose> path() const;
  [[nodiscard]] std::size_t landmarks() const { return map_.landmarks.size(); }
  [[nodiscard]] MappedLandmark landmark(std::size_t index) const;
  /// Of some landmarks, x and y of each [m²]: as costly as smoothing all of it once. Empty without landmarks.
  [[nodiscard]] Eigen::MatrixXd map_covariance(std::span<const std::size_t> landmarks) const;
  /// Whether its map has it.
  [[nodiscard]] bool has_landmark(std::size_t) const { return true; }
  /// Whether it surely exists: an unidentified one may be tentative.
  [[nodiscard]] bool is_confirmed(std::size_t index) const {
    return map_.landmarks[index].is_identified ||
           map_.landmarks[index].existence.is_confirmed(map_.visibility);
  }
  /// The landmark that what was once taken for `id` is known to be today: itself, if it is no duplicate.
  [[nodiscard]] LandmarkId merged(LandmarkId id) const;

  /// What it solves, and its solution so far: of what is far from here as it was when that last mattered.
  /// Of poses in the window alone; what was marginalised is no part of it.
  [[nodiscard]] const SmoothingProblem& problem() const { return problem_; }
  [[nodiscard]] SmoothingState state() const;

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.problem_.poses, self.problem_.landmarks, self.problem_.motions, self.problem_.sightings,
            self.problem_.bias_readings, self.at_, self.tree_, self.parts_, self.unknown_of_,
            self.pose_variables_, self.sees_, self.stamps_, self.term_of_, self.map_, self.past_,
            self.in_view_, self.since_, self.time_s_, self.report_);
  }

 private:
  struct Landmark {
    LandmarkId id = kUnknownLandmark;
    int variable = -1;
    bool is_identified = false;  ///< the caller gave its id: it exists
    int seen_from = -1;          ///< the last pose; below 0: as many before the window
    std::vector<std::size_t> sightings = {};
    std::size_t marginalised = 0;  ///< further sightings
    Existence existence = {};

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.id, self.variable, self.is_identified, self.seen_from, self.sightings, self.marginalised,
              self.existence);
    }
  };
  /// Which landmark each of the problem's is.
  struct Map {
    std::vector<Landmark> landmarks;      ///< in the problem's order
    std::map<LandmarkId, int> number_of;  ///< of those whose id the caller gave
    LandmarkId next_unidentified;         ///< id of the next landmark whose sighting has none
    std::map<LandmarkId, LandmarkId> merged_into;
    LandmarkGrid grid;        ///< of the unidentified landmarks
    double off_grid_m = 0.0;  ///< at most so far have they moved since all were put there
    Visibility visibility;

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.landmarks, self.number_of, self.next_unidentified, self.merged_into, self.grid,
              self.off_grid_m, self.visibility);
    }
  };
  /// A part of the problem, which is a term of the tree.
  struct Part {
    enum class Kind { motion, sighting, bias, parameters, past } kind;
    std::size_t index;

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.kind, self.index);
    }
  };
  /// What a variable of the tree is.
  struct Unknown {
    enum class Kind { pose, landmark, parameters, removed } kind;
    int index;

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.kind, self.index);
    }
  };
  /// A part of what was marginalised.
  struct PastPart {
    MarginalPrior prior;
    int term = -1;

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.prior, self.term);
    }
  };
  /// What sightings and motions before the window say.
  struct Past {
    std::vector<PastPart> parts;  ///< the first knows the first pose of the window, the others are submaps
    std::map<int, std::vector<int>> seen_with;  ///< variables of landmarks, of which one has no name

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.parts, self.seen_with);
    }
  };
  /// Since the last keyframe; its motion is about the systematic errors that were known there.
  struct SinceKeyframe {
    FreeMotion motion;
    double bias = 0.0;
    Eigen::VectorXd parameters;
    bool has_moved = false;

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.motion, self.bias, self.parameters, self.has_moved);
    }
  };
  /// The share of what is linear below which what hangs on a move is not asked.
  static constexpr double kMatters = 0.1;
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
  /// An observation and the landmark of the map that it shows, or may show.
  struct Match {
    std::size_t observation;
    int landmark;
  };
  /// Landmarks that may be one.
  struct Duplicate {
    int a, b;
  };
  /// Of some matches, two numbers each: (range, bearing), and the covariance of all together.
  struct Innovations {
    Eigen::VectorXd innovation;
    Eigen::MatrixXd S;
  };

  static LinearMoves linear_moves(const LandmarkSensor& sensor);
  [[nodiscard]] SinceKeyframe moved_on(const Motion& motion) const;
  void associate(std::span<const Observation> observations);
  [[nodiscard]] int landmark_of(std::size_t i, const Observation& observation) const;
  [[nodiscard]] Innovations innovations(std::span<const Match> matches,
                                        std::span<const Observation> observations) const;
  void judge(std::span<const std::size_t> shown, std::span<const Observation> observations);
  void append_by_body(const Eigen::MatrixXd& by_body, Eigen::Index column,
                      std::vector<EliminationTree::Derivative>& derivatives) const;
  void add_keyframe();
  void add_sighting(std::size_t i, const Observation& observation);
  int add_landmark(const Observation& observation);
  void give_id(int landmark, LandmarkId id);
  void remove_sighting(std::size_t sighting);
  void remove_landmark(int landmark);
  void merge(int kept, int gone);
  void revise_map();
  bool merge_duplicates();
  bool merge(const JointExplanation& explanation, std::span<const Duplicate> pairs);
  [[nodiscard]] bool are_seen_together(int a, int b) const;
  void note_moved(std::span<const int> solved);
  void refresh_grid();
  int add_unknown(const Unknown& unknown, const Eigen::VectorXd& tolerance);
  int add_part(const Part& part, std::span<const int> variables);
  void settle();
  void marginalise_old();
  void marginalise_first(int poses);
  [[nodiscard]] MarginalPrior::Unknown past_unknown(int variable, const SmoothingState& state) const;
  [[nodiscard]] MarginalPrior::NextPose next_pose(const MotionLink& link, const SmoothingState& state) const;
  void forget_first(int poses);
  void note_seen_together(int poses);
  void divide_past();
  void add_submap(MarginalPrior submap);
  void put_past(std::size_t part, MarginalPrior prior);
  void merge_past(int kept, int gone);
  void remove_from_past(int variable);
  [[nodiscard]] Eigen::VectorXd value_of(int variable, const SmoothingState& state) const;
  void linearise(int term, const SmoothingState& at, FrontSystem& system) const;
  bool relinearise(std::span<const int> solved);
  [[nodiscard]] bool has_moved_alone(int pose) const;
  bool relinearise_all();
  [[nodiscard]] Vector2 sight_of(int landmark, int pose) const;
  [[nodiscard]] Apart moved_apart(int landmark, int pose) const;
  /// Of a reading, as a share of its sigma, where a landmark has moved by `apart` against the pose. Eq. 23.
  [[nodiscard]] double left_out(const Vector2& apart, const Vector2& sight) const;
  [[nodiscard]] Pose2 linearisation_of(const Pose2& now) const;
  void move_linearisation(int variable, const Eigen::VectorXd& by);

  [[nodiscard]] bool is_between_keyframes() const { return since_.has_moved || pose_variables_.empty(); }
  [[nodiscard]] Eigen::MatrixXd map_covariance_of_tree(std::span<const std::size_t> landmarks) const;
  [[nodiscard]] PoseEstimate estimate_after(const SinceKeyframe& since) const;
  [[nodiscard]] Eigen::MatrixXd covariance_with_systematic(const FreeMotion& motion) const;
  [[nodiscard]] Pose2 pose_at(int keyframe) const;
  [[nodiscard]] double bias_at(int keyframe) const;
  [[nodiscard]] double keyframe_bias() const;
  [[nodiscard]] Eigen::VectorXd parameters() const;
  [[nodiscard]] Vector2 landmark_at(int landmark) const;
  [[nodiscard]] Pose2 pose_now() const { return pose_after(since_); }
  [[nodiscard]] Pose2 pose_after(const SinceKeyframe& since) const;

  IncrementalSmootherOptions options_;
  LinearMoves linear_;
  std::vector<int> free_;  ///< of the systematic errors, those that are parameters
  SmoothingProblem problem_;
  SmoothingState at_;                ///< where its terms are linearised
  EliminationTree tree_;             ///< of moves from there
  std::vector<Part> parts_;          ///< by term
  std::vector<Unknown> unknown_of_;  ///< by variable
  std::vector<int> pose_variables_;
  std::vector<int> sees_;       ///< by pose: a landmark; −1: none
  std::vector<double> stamps_;  ///< by pose [s]
  std::vector<int> term_of_;    ///< by sighting
  Map map_;
  Past past_;
  UnidentifiedSightings unidentified_;  ///< of the step at hand
  int parameter_variable_ = -1;
  std::vector<int> in_view_;  ///< variables of landmarks of the last keyframe
  SinceKeyframe since_;
  double time_s_ = 0.0;  ///< of the last step
  StepReport report_;
};

}  // namespace trundle::slam
