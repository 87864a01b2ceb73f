#include "trundle/slam/smoothing/incremental_smoother.hpp"

#include <utility>

#include "trundle/slam/models/systematic_errors.hpp"
#include "trundle/slam/nth.hpp"
#include "trundle/slam/smoothing/incremental/incremental_belief.hpp"

namespace trundle::slam {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

// So many keyframes are marginalised at once: each time the fronts from the end of the window up to the root
// are eliminated anew.
constexpr int kMarginalisedAtOnce = 8;

FactorGraphOptions graph_options(const IncrementalSmootherOptions& options, const std::vector<int>& free) {
  const Systematic& sigma = options.prior.systematic_sigma;
  return {.parameter_sigma = sigma(free),
          .bias_sigma = options.has_bias ? std::optional(sigma[0]) : std::nullopt,
          .gate = options.gate,
          .most_rounds = options.most_rounds};
}

bool is_between_keyframes(const IncrementalBelief& belief) {
  return belief.since.has_moved || belief.graph.poses() == 0;
}

void add_keyframe(IncrementalBelief& belief) {
  SinceKeyframe& since = belief.since;
  const SlamPrior& prior = belief.options.prior;
  const int pose = belief.graph.poses();
  const double bias = belief.graph.last_bias();
  const double bias_sigma = belief.options.has_bias ? prior.systematic_sigma[0] : 0.0;
  MotionLink link = pose > 0 ? link_of(pose - 1, pose, since.motion)
                             : link_from({.pose = prior.start, .bias_variance = bias_sigma * bias_sigma},
                                         pose, since.motion);
  link.included = since.motion.by_parameters * since.parameters + since.motion.by_bias * since.bias;
  belief.graph.add_pose(pose_now(belief), std::move(link));
  belief.stamps.push_back(belief.time_s);
  since.motion = {{}, Matrix3::Zero(), Eigen::Matrix3Xd::Zero(3, static_cast<Index>(belief.free.size()))};
  since.parameters = belief.graph.parameters();
  since.bias = bias;
  since.has_moved = false;
}

void marginalise_old(IncrementalBelief& belief) {
  if (!belief.options.window_s) return;
  const auto is_old = [&](double stamp_s) { return stamp_s < belief.time_s - *belief.options.window_s; };
  while (static_cast<int>(belief.stamps.size()) > kMarginalisedAtOnce &&
         is_old(belief.stamps[nth(kMarginalisedAtOnce - 1)])) {
    belief.seen_together.add_first(kMarginalisedAtOnce, belief.graph, belief.table);
    belief.graph.marginalise_first(kMarginalisedAtOnce);
    belief.stamps.erase(belief.stamps.begin(), belief.stamps.begin() + kMarginalisedAtOnce);
  }
}

}  // namespace

IncrementalBelief::IncrementalBelief(const LandmarkSensor& sensor, const IncrementalSmootherOptions& chosen)
    : options(chosen),
      free(free_of(options.prior.systematic_sigma, options.has_bias)),
      graph(sensor, graph_options(options, free)),
      table(sensor.max_range_m, options.first_unidentified),
      unidentified(sensor, options.gate) {
  const auto parameters = static_cast<Index>(free.size());
  since.parameters = VectorXd::Zero(parameters);
  since.motion = {{},
                  body_covariance(options.prior.start, options.prior.start_covariance),
                  Eigen::Matrix3Xd::Zero(3, parameters)};
}

void settle(IncrementalBelief& belief) {
  marginalise_old(belief);
  belief.graph.settle(
      [&](int landmark) { belief.table.note_moved(landmark, belief.graph.landmark_at(landmark)); });
}

const StepReport& IncrementalSmoother::step(const Motion& motion, std::span<const Observation> observations,
                                            double time_s) {
  IncrementalBelief& belief = *belief_;
  StepReport& report = belief.report;
  belief.time_s = time_s;
  report.observations.assign(observations.size(), {});
  belief.since = moved_on(motion, belief);
  associate(observations, belief);
  std::vector<std::size_t> shown;
  for (std::size_t i = 0; i < observations.size(); ++i)
    if (is_valid(observations[i]) && report.observations[i].decision != Decision::rejected)
      shown.push_back(i);
  if (shown.empty()) return report;
  gate(shown, observations, belief);
  add_keyframe(belief);
  belief.graph.clear_view();
  for (const std::size_t i : shown) add_sighting(i, observations[i], belief);
  settle(belief);
  revise_map(belief);
  return report;
}

void IncrementalSmoother::read_bias(const BiasReading& reading) {
  if (!belief_->options.has_bias) return;
  if (is_between_keyframes(*belief_)) add_keyframe(*belief_);
  belief_->graph.add_bias_reading(reading.rad_s, reading.variance);
  settle(*belief_);
}

IncrementalSmoother::IncrementalSmoother(const LandmarkSensor& sensor,
                                         const IncrementalSmootherOptions& options)
    : belief_(std::make_unique<IncrementalBelief>(sensor, options)) {}
IncrementalSmoother::IncrementalSmoother(const IncrementalSmoother& other)
    : belief_(std::make_unique<IncrementalBelief>(*other.belief_)) {}
IncrementalSmoother::IncrementalSmoother(IncrementalSmoother&& other) noexcept = default;
IncrementalSmoother& IncrementalSmoother::operator=(IncrementalSmoother other) noexcept {
  belief_.swap(other.belief_);
  return *this;
}
IncrementalSmoother::~IncrementalSmoother() = default;

PoseEstimate IncrementalSmoother::estimate() const {
  return estimate_of(*belief_);
}

PoseEstimate IncrementalSmoother::estimate_after(const Motion& motion) const {
  return estimate_of(*belief_, moved_on(motion, *belief_));
}

std::vector<StampedPose> IncrementalSmoother::path() const {
  std::vector<StampedPose> path;
  for (int i = 0; i < belief_->graph.poses(); ++i)
    path.push_back({belief_->stamps[nth(i)], belief_->graph.pose_at(i)});
  return path;
}

std::size_t IncrementalSmoother::landmarks() const {
  return nth(belief_->graph.landmarks());
}

MappedLandmark IncrementalSmoother::landmark(std::size_t index) const {
  const auto landmark = static_cast<int>(index);
  const FactorGraph& graph = belief_->graph;
  return {belief_->table.id_of(landmark), graph.landmark_at(landmark), graph.landmark_covariance(landmark),
          belief_->table.sightings(landmark)};
}

Eigen::MatrixXd IncrementalSmoother::map_covariance(std::span<const std::size_t> landmarks) const {
  return belief_->graph.map_covariance(landmarks);
}

bool IncrementalSmoother::is_confirmed(std::size_t index) const {
  return belief_->table.is_confirmed(static_cast<int>(index));
}

LandmarkId IncrementalSmoother::merged(LandmarkId id) const {
  const auto& into = belief_->merged_into;
  for (auto found = into.find(id); found != into.end(); found = into.find(id)) id = found->second;
  return id;
}

const SmoothingProblem& IncrementalSmoother::problem() const {
  return belief_->graph.problem();
}

SmoothingState IncrementalSmoother::state() const {
  return belief_->graph.state();
}

bool IncrementalSmoother::has_marginalised() const {
  return belief_->graph.has_marginalised();
}

void IncrementalSmoother::persist(io::StateWriter& archive, const IncrementalSmoother& self) {
  archive(*self.belief_);
}

void IncrementalSmoother::persist(io::StateReader& archive, IncrementalSmoother& self) {
  archive(*self.belief_);
}

}  // namespace trundle::slam
