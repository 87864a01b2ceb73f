#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "trundle/geometry/trajectory.hpp"
#include "trundle/io/archive.hpp"
#include "trundle/slam/association/association.hpp"
#include "trundle/slam/report.hpp"

namespace trundle::slam {

struct IncrementalBelief;
struct SmoothingProblem;
struct SmoothingState;

/// Of the smoother that goes along.
struct IncrementalSmootherOptions {
  SlamPrior prior = {};
  bool has_bias = false;       ///< the first of the systematic errors walks: the gyro's bias
  double gate = kDefaultGate;  ///< NIS beyond which a sighting has less weight than its square: an outlier
  int most_rounds = 10;        ///< linearisations in one step; what is left is done in the next one
  /// How long poses stay unknowns [s]: older ones are marginalised, so that neither memory nor the time of a
  /// step grow as it drives on. Nothing: always.
  std::optional<double> window_s = {};
  LandmarkId first_unidentified =
      0;  ///< unidentified landmarks are numbered from here on: above all given ids
};

/// All poses, landmarks and systematic errors by nonlinear least squares, as it drives: after each step the
/// estimate is that of the batch (smoother.hpp) over everything so far. A step costs what is in view; closing
/// a loop costs the loop, once. A value; a copy continues independently. Equations:
/// docs/theory/online-smoother.md.
class IncrementalSmoother {
 public:
  IncrementalSmoother(const LandmarkSensor& sensor, const IncrementalSmootherOptions& options);
  IncrementalSmoother(const IncrementalSmoother& other);
  IncrementalSmoother(IncrementalSmoother&& other) noexcept;
  IncrementalSmoother& operator=(IncrementalSmoother other) noexcept;
  ~IncrementalSmoother();

  /// One motion and what was seen at its end. Sightings without an id show what explains all of them best;
  /// landmarks that turn out to be one become one. The stamp is for the window alone.
  const StepReport& step(const Motion& motion, std::span<const Observation> observations,
                         double time_s = 0.0);
  /// What the gyro reads at rest, after a step.
  void read_bias(const BiasReading& reading);

  /// Of now, in the world, given everything so far.
  [[nodiscard]] PoseEstimate estimate() const;
  /// The same after a further motion, of which no step is made.
  [[nodiscard]] PoseEstimate estimate_after(const Motion& motion) const;
  /// Where it was at its keyframes, with their stamps; of those in the window.
  [[nodiscard]] std::vector<StampedPose> path() const;
  [[nodiscard]] std::size_t landmarks() const;
  [[nodiscard]] MappedLandmark landmark(std::size_t index) const;
  /// Of some landmarks, x and y of each [m²]: as costly as smoothing all of it once. Empty without landmarks.
  [[nodiscard]] Eigen::MatrixXd map_covariance(std::span<const std::size_t> landmarks) const;
  /// Whether its map has it.
  [[nodiscard]] bool has_landmark(std::size_t) const { return true; }
  /// Whether it surely exists: an unidentified one may be tentative.
  [[nodiscard]] bool is_confirmed(std::size_t index) const;
  /// The landmark that what was once taken for `id` is known to be today: itself, if it is no duplicate.
  [[nodiscard]] LandmarkId merged(LandmarkId id) const;

  /// What it solves, and its solution so far: of what is far from here as it was when that last mattered.
  /// Of poses in the window alone; what was marginalised is no part of it.
  [[nodiscard]] const SmoothingProblem& problem() const;
  [[nodiscard]] SmoothingState state() const;
  /// Whether anything was.
  [[nodiscard]] bool has_marginalised() const;

  /// Its state, for io/archive.hpp: one of the same sensor and options continues with it to the last bit.
  static void persist(io::StateWriter& archive, const IncrementalSmoother& self);
  static void persist(io::StateReader& archive, IncrementalSmoother& self);

 private:
  std::unique_ptr<IncrementalBelief> belief_;
};

}  // namespace trundle::slam
