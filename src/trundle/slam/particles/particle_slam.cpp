#include "trundle/slam/particles/particle_slam.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

#include <Eigen/Cholesky>

#include "trundle/io/error.hpp"
#include "trundle/slam/cholesky.hpp"
#include "trundle/slam/particles/pose_target.hpp"

namespace trundle {
namespace {

Matrix3 pose_root(const Pose2& pose, const Matrix3& covariance_in_world) {
  return semidefinite_root(body_covariance(pose, covariance_in_world));
}

bool is_by_swarm(Proposal proposal) {
  return proposal == Proposal::swarm || proposal == Proposal::swarm_gaussian;
}

}  // namespace

ParticleSlam::ParticleSlam(const LandmarkSensor& sensor, const ParticleSlamOptions& options)
    : sensor_(sensor),
      options_(options),
      crew_(options.threads, options.particles),
      resampling_(options.seed, kResamplingStream),
      poses_(options.particles),
      predicted_(options.particles),
      n_(options.particles),
      z_(options.particles),
      sensors_(options.particles),
      log_weights_(padded(options.particles), 0.0),
      weights_(padded(options.particles)),
      parents_(options.particles + 1),
      first_child_(options.particles + 1, static_cast<Ancestry::Index>(options.particles)),
      spare_(padded(options.particles)),
      ancestry_(options.particles),
      map_(options.particles, options.map_precision, options.first_nameless),
      jury_(options.particles, options.map_precision, options.prior.systematic_sigma.size()),
      association_(sensor, {options.particles, options.map_precision}),
      swarm_(is_by_swarm(options.proposal) ? options.particles : 0),
      systematic_(options.particles, options.prior.systematic_sigma.size()),
      pending_(options.prior.systematic_sigma) {
  if (options.particles == 0) throw InputError("particle filter", "has 0 particles", "at least 1");
  const Pose2& start = options.prior.start;
  for (std::size_t i = 0; i < all().last; ++i) predicted_.set(i, start);
  draw_normals(next_draw(), all(), n_);
  place(predicted_, n_, {pose_root(start, options.prior.start_covariance), sensor.body_from_sensor}, all(),
        poses_, sensors_);
  normalise();
}

const StepReport& ParticleSlam::step(const Motion& motion, std::span<const Observation> observations) {
  report_.observations.assign(observations.size(), {});
  report_.resampled = false;
  report_.closed_loop = false;
  drive(motion);
  if (!observations.empty()) loop_.next_station();
  recognise(observations);
  note_returns();
  distrust_few();
  if (seen_.empty() && open_.empty() && !association_.sees_something()) {
    if (options_.keep_paths) paths_.coast(since_drawn_);
    watch_for_loop(observations);
    return report_;
  }
  move_and_weigh();
  learn_systematic();
  settle(observations);
  normalise();
  if (options_.keep_paths) paths_.arrive(since_drawn_, poses(), ancestry_, drift_);
  since_drawn_ = {};
  begin_pending();
  const double limit = options_.resample_below * static_cast<double>(options_.particles);
  if (report_.effective_particles < limit) resample();
  watch_for_loop(observations);
  return report_;
}

/// What the odometry may have erred by adds up: A of eq. 66. All particles are near the first.
void ParticleSlam::drive(const Motion& motion) {
  pending_.add(motion);
  since_drawn_ = since_drawn_ * motion;
  const Pose2 here = poses_.at(0) * since_drawn_.mean;
  drift_ = drift_.about(here.translation());
  drift_.covariance += world_covariance({here, motion.covariance});
}

/// Observations of landmarks in the map that are no outliers; the valid rest stays open.
void ParticleSlam::recognise(std::span<const Observation> observations) {
  seen_.clear();
  open_.clear();
  for (std::size_t i = 0; i < observations.size(); ++i) {
    if (!is_valid(observations[i]) || observations[i].landmark < 0) continue;
    const LandmarkId landmark = map_.find(observations[i].landmark);
    if (landmark < 0)
      open_.push_back(i);
    else
      seen_.push_back({i, landmark, reading_terms(observations[i], sensor_)});
  }
  association_.collect(observations);
  if (!seen_.empty() || association_.sees_something()) convene();
  reject_outliers();
}

void ParticleSlam::convene() {
  jury_.meet({poses_, systematic_, pending_.prediction(), weights_, best_particle(), predicted_covariance(),
              sensor_.body_from_sensor});
}

/// Eq. 14. Reports what the most probable particle finds, before this step has moved or weighted any.
void ParticleSlam::reject_outliers() {
  std::erase_if(seen_, [&](const Seen& s) {
    const Jury::Verdict verdict = jury_.on(s.reading, map_.inherited(s.landmark, ancestry_), options_.gate);
    report_.observations[s.observation] = {verdict.rejected ? Decision::rejected : Decision::matched,
                                           verdict.rejected ? kUnknownLandmark : map_.id_of(s.landmark),
                                           verdict.innovation, verdict.nis};
    return verdict.rejected;
  });
}

/// Predictions, the landmarks that will be needed, and random numbers, up to this step.
void ParticleSlam::bring_up(const Draw& draw, ParticleRange range) {
  predict(poses_, systematic_, pending_.prediction(), range, predicted_);
  map_.inherit(range);
  draw_normals(draw, range, n_);
}

/// Each particle finds out what it sees: where it will be drawn if that depends on the motion alone, else at
/// its prediction with the motion's uncertainty.
void ParticleSlam::look(const Draw& draw) {
  const Matrix3 covariance = predicted_covariance();
  const bool stays = options_.proposal == Proposal::motion;
  const Matrix3 Ad = adjoint(sensor_.body_from_sensor.inverse());
  const Matrix3 L = stays ? semidefinite_root(covariance) : Matrix3(Matrix3::Zero());
  const Matrix3 unsure = stays ? Matrix3(Matrix3::Zero()) : Matrix3(Ad * covariance * Ad.transpose());
  const ParticleAssociation::View view{sensors_, unsure, best_particle(), draw, log_weights_.data(), jury_};
  association_.look_up(view, map_, ancestry_);
  crew_.for_all_particles([&](ParticleRange piece) {
    bring_up(draw, piece);
    place(predicted_, n_, {L, sensor_.body_from_sensor}, piece, poses_, sensors_);
    association_.choose(view, piece);
  });
  association_.decide(view);
}

/// Poses are drawn, take their weights and improve their landmarks: all of it for one piece of the particles
/// at a time, unless something has to be decided about all of them in between.
void ParticleSlam::move_and_weigh() {
  const Proposal proposal = options_.proposal;
  const bool by_swarm = is_by_swarm(proposal);
  const bool by_gaussian = proposal == Proposal::linearised || proposal == Proposal::swarm_gaussian;
  const Placement placement{semidefinite_root(predicted_covariance()), sensor_.body_from_sensor};
  const Draw draw = next_draw();
  const Draw second_draw = next_draw();
  predict(poses_, systematic_, pending_.prediction(), {0, kParticleLanes}, predicted_);
  sensors_.origin = predicted_.at(0).translation();
  readings_.clear();
  for (const Seen& s : seen_) {
    readings_.push_back({s.reading, &map_.expect(s.landmark, ancestry_)});
    map_.count_sighting(s.landmark);
  }
  const bool looks = association_.sees_something();
  if (looks)
    look(draw);
  else if (by_swarm)
    crew_.for_all_particles([&](ParticleRange piece) { bring_up(draw, piece); });
  association_.add_readings(readings_);
  near_.set(readings_, sensors_.origin);
  if (by_swarm)
    swarm_.refine({predicted_, placement.L, sensor_.body_from_sensor, near_, second_draw}, options_.swarm,
                  crew_, n_);
  const bool is_placed = looks && proposal == Proposal::motion;
  crew_.for_all_particles([&](ParticleRange piece) {
    if (!looks && !by_swarm) bring_up(draw, piece);
    if (proposal == Proposal::swarm_gaussian) draw_normals(second_draw, piece, z_);
    if (by_gaussian && !readings_.empty()) draw_near_sightings(placement, piece);
    if (!is_placed) place(predicted_, n_, placement, piece, poses_, sensors_);
    weigh_and_improve(near_, sensors_, piece, log_weights_.data());
  });
  map_.all_have_inherited();
}

/// Eq. 16: n becomes a draw from the Gaussian at n; the weights take prior over proposal.
void ParticleSlam::draw_near_sightings(const Placement& placement, ParticleRange range) {
  const bool after_swarm = options_.proposal == Proposal::swarm_gaussian;
  const Matrix3 L = adjoint(sensor_.body_from_sensor.inverse()) * placement.L;
  place(predicted_, n_, {Matrix3::Zero(), sensor_.body_from_sensor}, range, poses_, sensors_);
  const GaussianProposal gaussians{sensors_, L, after_swarm ? &n_ : nullptr, after_swarm ? z_ : n_};
  draw_from_gaussians(near_, gaussians, range, n_, log_weights_.data());
}

/// A Kalman filter for each particle, given its path: the drawn pose is a measurement of S s, whose error
/// against the prediction is L n. Eq. 10.
void ParticleSlam::learn_systematic() {
  if (pending_.systematic() == 0) return;
  const auto by_n = (pending_.gain() * semidefinite_root(predicted_covariance())).eval();
  for (std::size_t i = 0; i < options_.particles; ++i)
    systematic_.set(i, pending_.systematic_of(systematic_.at(i)) + by_n * n_.at(i));
}

/// Poses have been drawn and weighted.
void ParticleSlam::begin_pending() {
  Systematic mean = Systematic::Zero(pending_.systematic());
  if (pending_.systematic() > 0)
    for (std::size_t i = 0; i < options_.particles; ++i) mean += weights_[i] * systematic_.at(i);
  pending_.drawn(mean);
}

/// Particles that have come where they are with another bias are less likely. Eq. 10b.
void ParticleSlam::read_bias(const BiasReading& reading) {
  if (pending_.systematic() == 0) return;
  for (std::size_t i = 0; i < options_.particles; ++i)
    log_weights_[i] += pending_.log_likelihood(reading, systematic_.at(i));
  pending_.read(reading);
  normalise();
}

/// Sightings without names find their way back into the map; then come the landmarks that are new.
void ParticleSlam::settle(std::span<const Observation> observations) {
  const auto add_named = [&] {
    for (const std::size_t i : open_) add_landmark(observations[i], i);
  };
  if (!association_.sees_something()) return add_named();
  const auto best = static_cast<std::size_t>(std::ranges::max_element(log_weights_) - log_weights_.begin());
  const Pose2 sensor = poses_.at(best) * sensor_.body_from_sensor;
  const ParticleAssociation::Drawn drawn{sensors_, sensor, log_weights_.data(), weights_, jury_};
  association_.settle(drawn, map_, ancestry_, report_);
  add_named();
  association_.create(drawn, map_, ancestry_, report_);
}

/// A landmark seen for the first time; a second sighting of it in the same step improves it.
void ParticleSlam::add_landmark(const Observation& observation, std::size_t index) {
  const ReadingTerms reading = reading_terms(observation, sensor_);
  ObservationReport& report = report_.observations[index];
  report.landmark = observation.landmark;
  if (const LandmarkId known = map_.find(observation.landmark); known >= 0) {
    report.decision = Decision::matched;
    const KnownReading again{reading, &map_.current(known, ancestry_)};
    weigh_and_improve({{&again, 1}, sensors_.origin}, sensors_, all(), log_weights_.data());
    return map_.count_sighting(known);
  }
  report.decision = Decision::created;
  const LandmarkEstimate near = first_estimate(sensor_at(poses_.at(0), sensor_.body_from_sensor), reading);
  const LandmarkId landmark = map_.add(observation.landmark, {near.x, near.y}, ancestry_);
  set_first_estimates(reading, sensors_, all(), map_.current(landmark, ancestry_));
}

void ParticleSlam::normalise() {
  std::fill(log_weights_.begin() + static_cast<std::ptrdiff_t>(options_.particles), log_weights_.end(),
            -std::numeric_limits<double>::infinity());
  const auto effective = [&] { return trundle::normalise(all(), log_weights_.data(), weights_.data()); };
  report_.effective_particles = effective();
  if (report_.effective_particles == 0.0) {  // no particle can explain the step
    std::fill_n(log_weights_.begin(), options_.particles, 0.0);
    report_.effective_particles = effective();
  }
  leading_ = best_particle();
  report_.greatest_weight = weights_[leading_];
}

/// Systematic: one random number, and as many children for each as its weight says, to within one. Child i
/// has the first parent up to whom the weights sum to (i + offset)/N. Numbers of children are a matter of
/// chance, so no branch asks them.
void ParticleSlam::resample() {
  const std::size_t count = options_.particles;
  const auto all_children = static_cast<double>(count);
  const double before = 1.0 - resampling_.uniform();
  std::ranges::fill(parents_, Ancestry::Index{0});
  double sum = 0.0;
  Ancestry::Index first = 0;  // child of the next parent, if he has one
  for (std::size_t parent = 0; parent < count; ++parent) {
    first_child_[parent] = first;
    parents_[first] = static_cast<Ancestry::Index>(parent);
    sum += weights_[parent];
    first = static_cast<Ancestry::Index>(std::min(sum * all_children + before, all_children));
  }
  const std::span parents(parents_.data(), count);
  Ancestry::Index last = 0;
  for (Ancestry::Index& parent : parents) parent = last = std::max(last, parent);
  poses_.permute(parents, spare_);
  if (pending_.systematic() > 0) systematic_.permute(parents, spare_);
  kinship_.hold(ancestry_);
  ancestry_.resample_families(first_child_);
  if (options_.keep_paths) paths_.resampled(ancestry_);
  std::fill_n(log_weights_.begin(), count, 0.0);
  std::fill_n(weights_.begin(), count, 1.0 / static_cast<double>(count));
  report_.resampled = true;
  leading_ = first_child_[leading_];
  keep_doubt();
}

/// The largest logarithm is 0.
std::size_t ParticleSlam::best_particle() const {
  return static_cast<std::size_t>(std::ranges::find(log_weights_, 0.0) - log_weights_.begin());
}

std::vector<Pose2> ParticleSlam::poses() const {
  std::vector<Pose2> poses;
  poses.reserve(options_.particles);
  for (std::size_t i = 0; i < options_.particles; ++i) poses.push_back(poses_.at(i));
  return poses;
}

bool ParticleSlam::has_landmark(std::size_t index) const {
  return map_.has(static_cast<LandmarkId>(index), best_particle(), ancestry_);
}

std::vector<double> ParticleSlam::weights() const {
  return {weights_.begin(), weights_.begin() + static_cast<std::ptrdiff_t>(options_.particles)};
}

std::vector<Pose2> ParticleSlam::best_path() const {
  const std::size_t best = best_particle();
  return paths_.path_of({static_cast<Ancestry::Index>(best), options_.prior.start, systematic_.at(best)},
                        ancestry_);
}

}  // namespace trundle
