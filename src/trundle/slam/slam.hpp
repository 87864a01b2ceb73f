#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "trundle/geometry/trajectory.hpp"
#include "trundle/io/archive.hpp"
#include "trundle/slam/fastslam/particle_options.hpp"
#include "trundle/slam/report.hpp"
#include "trundle/slam/smoothing/incremental/growth.hpp"
#include "trundle/slam/smoothing/smoother_fit.hpp"
#include "trundle/slam/steps.hpp"

namespace trundle::slam {

/// Which filter: FastSLAM 1.0 and 2.0 [Montemerlo et al. 2002, 2003], with particles moved by a swarm as
/// published or as a weighted proposal (docs/theory/swarm.md), one extended Kalman filter, or the smoother
/// that goes along.
enum class SlamMethod { fastslam1, fastslam2, mapso, mapso_proposal, ekf, smoother };

/// As on the command line and in results: `fastslam1`.
[[nodiscard]] std::string_view name_of(SlamMethod method);
/// Nothing when no method is called so.
[[nodiscard]] std::optional<SlamMethod> slam_method_named(std::string_view name);
/// All names, in order.
[[nodiscard]] std::vector<std::string> slam_method_names();
/// Whether `particles`, `seed`, `resample_below`, `keep_paths`, `threads` and `estimate` mean anything to it.
[[nodiscard]] bool has_particles(SlamMethod method);
/// What it gives for its pose where nothing else is asked.
[[nodiscard]] PointEstimate usual_estimate(SlamMethod method);

/// Of any filter; what one has no use for it ignores. The world is the frame in which the prior's start is
/// given.
struct SlamOptions {
  SlamMethod method = SlamMethod::smoother;
  std::size_t particles = 100;  ///< `ekf` and `smoother` have none
  std::uint64_t seed = 1;       ///< nor do they need one
  SlamPrior prior = {};
  bool has_bias = false;        ///< the first of the systematic errors is the gyro's bias, which walks
  double gate = kDefaultGate;   ///< NIS above which a sighting is an outlier
  double resample_below = 0.5;  ///< effective particles, as a share of all
  bool keep_paths = true;       ///< false: no best path, and memory does not grow with time
  bool keep_growth = false;     ///< of `smoother`: SlamResult::growth
  bool judge_fit = true;        ///< of `smoother`: SlamResult::fit; smooth() says the same
  std::size_t threads = 1;      ///< results do not depend on it
  SwarmOptions swarm = {};      ///< of `mapso` and `mapso_proposal`
  std::optional<PointEstimate> estimate = {};  ///< nothing: best of `mapso`, as published, mean of others
  std::optional<double> window_s = {};         ///< of `smoother`: older poses are marginalised [s]
  LandmarkId first_unidentified = 0;           ///< ids of unidentified landmarks: above all given ones
};

/// The options completed by what the steps of a recording have: 1σ of the odometry's systematic errors, where
/// the prior says nothing of them, and where the numbers of landmarks without names begin.
[[nodiscard]] SlamOptions slam_options_for(const SlamInput& input, SlamOptions options = {});

/// A particle, without its map.
struct WeightedPose {
  Pose2 pose;
  double weight = 0.0;  ///< all of them sum to 1
};

/// Any of the filters: a value; a copy continues independently. Equations: docs/theory/fastslam.md, ekf.md,
/// online-smoother.md.
class SlamFilter {
 public:
  /// Throws InputError when a particle filter is to have no particle.
  SlamFilter(const LandmarkSensor& sensor, const SlamOptions& options);
  SlamFilter(const SlamFilter& other);
  SlamFilter(SlamFilter&& other) noexcept;
  SlamFilter& operator=(SlamFilter other) noexcept;
  ~SlamFilter();

  /// One motion of the body and what was seen at its end; what became of each observation, valid until the
  /// next step. The smoother throws CannotAnswer where poses or landmarks are left undetermined.
  const StepReport& step(const Motion& motion, std::span<const Observation> observations);
  /// The same, and what the gyro read at rest since the step before.
  const StepReport& step(const SlamStep& step);
  /// What the gyro reads at rest, after a step; no filter without systematic errors listens.
  void read_bias(const BiasReading& reading);

  /// Of the body in the world, from what was seen up to now.
  [[nodiscard]] PoseEstimate estimate() const;
  /// The same after a further motion, of which no step is made.
  [[nodiscard]] PoseEstimate estimate_after(const Motion& motion) const;
  /// Landmarks that surely exist.
  [[nodiscard]] std::vector<MappedLandmark> map() const;
  /// How many that has.
  [[nodiscard]] std::size_t landmarks() const;
  /// Of all of map() together, x and y of each in its order [m²]; empty for particles.
  [[nodiscard]] Eigen::MatrixXd map_covariance() const;
  /// Unidentified landmarks that are not confirmed, or not any more. They are no part of the map.
  [[nodiscard]] std::vector<MappedLandmark> tentative() const;
  /// What a landmark of a report is known to be today: itself, or one that it was the duplicate of.
  [[nodiscard]] LandmarkId merged(LandmarkId id) const;
  /// Of the particle with the largest weight, after each step; empty without particles and when paths are not
  /// kept.
  [[nodiscard]] std::vector<Pose2> best_path() const;
  /// Where something was last seen; empty for filters that have none.
  [[nodiscard]] std::vector<WeightedPose> particles() const;
  /// Null where it is another filter.
  [[nodiscard]] const IncrementalSmoother* smoother() const;

  /// Its state, for io/archive.hpp: a filter of the same sensor and options continues with it to the last
  /// bit.
  static void persist(io::StateWriter& archive, const SlamFilter& self);
  static void persist(io::StateReader& archive, SlamFilter& self);

 private:
  struct AnyFilter;
  std::unique_ptr<AnyFilter> filter_;
};

/// Its map with the covariances that map_covariance() has of them, where it has one: linearised where all
/// stands now, while the landmarks' own may be of earlier.
[[nodiscard]] std::vector<MappedLandmark> map_with(const Eigen::MatrixXd& covariance,
                                                   const SlamFilter& filter);

/// Sightings by what became of them, and what their innovations say.
struct SlamCounts {
  std::size_t matched = 0;
  std::size_t created = 0;
  std::size_t rejected = 0;
  std::size_t invalid = 0;
  std::size_t resampled = 0;  ///< steps
  std::optional<double> mean_nis =
      {};  ///< of matched and rejected sightings; 2 if consistent; nothing: there are none
  std::optional<double> median_nis = {};  ///< 1.39 if consistent
  double smallest_effective_share = 1.0;  ///< of the particles, over all steps
};

/// How long steps with sightings took: of the wall clock, so no two runs agree.
struct StepTimes {
  double median_s = 0.0;
  double p99_s = 0.0;  ///< 99 % took less
  double longest_s = 0.0;
};

/// A whole recording, filtered.
struct SlamResult {
  Trajectory online;               ///< after each step, from what was seen up to then; with covariance
  std::optional<Trajectory> path;  ///< best particle's whole path; nothing without particles
  PoseEstimate last;               ///< after the last step, with the odometry's systematic errors
  std::vector<MappedLandmark> map;
  Eigen::MatrixXd map_covariance;         ///< of all of them, x and y of each; empty: not known together
  std::vector<MappedLandmark> tentative;  ///< without names and not surely there: no part of the map
  std::vector<WeightedPose> particles;    ///< where something was last seen; empty for other filters
  std::vector<StepReport> reports;        ///< one for each step
  std::vector<double> moved_m;            ///< likewise: how far what was seen moved the pose
  std::vector<Snapshot> growth;           ///< of the smoother, where it was asked to keep that
  std::vector<BiasEstimate> bias;         ///< after each step: the first of the systematic errors, if any
  SlamCounts counts;
  std::optional<SmootherFit> fit;  ///< of the smoother without a window, where it was asked to judge that: of
                                   ///< all that it saw, in the end
  StepTimes step_times;

  /// The greatest id that it ever took a sighting for, of landmarks that are gone too; kUnknownLandmark:
  /// none.
  [[nodiscard]] LandmarkId last_landmark() const;
};

/// A recording while it is filtered: it can be left after any step, stored, and taken up again by a run of
/// the same sensor and options, and nobody will see where.
class SlamRun {
 public:
  SlamRun(const LandmarkSensor& sensor, const SlamOptions& options);

  void step(const SlamStep& step);
  [[nodiscard]] std::size_t steps() const { return reports_.size(); }
  [[nodiscard]] SlamResult result() const;

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.filter_, self.online_, self.reports_, self.bias_, self.moved_m_, self.systematic_,
            self.growth_);
  }

 private:
  [[nodiscard]] double moved_m(const SlamStep& step, const PoseEstimate& estimate) const;

  std::size_t particles_;
  bool keep_growth_;
  bool judge_fit_;
  SlamFilter filter_;
  Trajectory online_;
  std::vector<StepReport> reports_;
  std::vector<BiasEstimate> bias_;
  std::vector<double> moved_m_;
  Systematic systematic_;  ///< as known after the last step
  Growth growth_;
  std::vector<double> seconds_;  ///< of steps with sightings; of this process, and no part of the state
};

/// A loop over SlamRun::step, with slam_options_for(input, options); throws as SlamFilter does.
[[nodiscard]] SlamResult slam(const SlamInput& input, const LandmarkSensor& sensor,
                              const SlamOptions& options = {});

}  // namespace trundle::slam
