#include "trundle/slam/fastslam/particle_slam.hpp"

#include <algorithm>

#include <Eigen/Cholesky>

#include "trundle/io/error.hpp"
#include "trundle/slam/cholesky.hpp"

namespace trundle::slam {
namespace {

ParticleBelief belief_at(const SlamPrior& prior, const ParticleSlamOptions& options) {
  const Systematic& sigma = prior.systematic_sigma;
  return {.particles = {options.particles, sigma.size()},
          .map = ParticleMap(options.particles, options.first_unidentified),
          .paths = ParticlePaths(options.keep_paths),
          .pending = PendingMotion(sigma)};
}

}  // namespace

ParticleSlam::ParticleSlam(const LandmarkSensor& sensor, const ParticleSlamOptions& options)
    : sensor_(sensor),
      options_(options),
      thread_pool_(options.threads, options.particles),
      belief_(belief_at(options.prior, options)),
      proposal_(options.proposal, options.swarm, options.particles),
      resampling_(options.seed, options.particles),
      gating_sample_(options.particles, options.prior.systematic_sigma.size()),
      association_(sensor, options.particles) {
  if (options.particles == 0) throw InputError("particle filter", "has 0 particles", "at least 1");
  ParticleSet& particles = belief_.particles;
  const Pose2& start = options.prior.start;
  for (std::size_t i = 0; i < particles.all().last; ++i) particles.predicted.set(i, start);
  draw_normals(next_draw(), particles.all(), particles.noise);
  const Matrix3 L = semidefinite_root(body_covariance(start, options.prior.start_covariance));
  place(particles.predicted, particles.noise, {L, sensor.body_from_sensor}, particles.all(), particles.poses,
        particles.sensors);
  normalise_weights();
}

const StepReport& ParticleSlam::step(const Motion& motion, std::span<const Observation> observations) {
  report_.observations.assign(observations.size(), {});
  report_.resampled = false;
  predict(motion, belief_);
  gate(observations);
  if (!sees_something()) return report_;
  const Placement by_motion{semidefinite_root(belief_.pending.covariance()), sensor_.body_from_sensor};
  predict_and_associate(next_draw(), by_motion);
  const PoseProposal::Step proposal{seen_.near, by_motion, next_draw()};
  proposal_.refine(proposal, thread_pool_, belief_.particles);
  thread_pool_.for_all_particles([&](ParticleRange block) { propose_and_weigh(proposal, block); });
  learn_systematic(belief_);
  create_landmarks(observations);
  normalise_weights();
  add_keyframe(belief_);
  resample_if_poor();
  return report_;
}

/// Eq. 14: observations of landmarks in the map that are no outliers, and those of others. Reports what the
/// most probable particle finds, before this step has moved or weighed any.
void ParticleSlam::gate(std::span<const Observation> observations) {
  ParticleSet& particles = belief_.particles;
  seen_.matched.clear();
  seen_.unmapped.clear();
  for (std::size_t i = 0; i < observations.size(); ++i) {
    if (!is_valid(observations[i]) || observations[i].landmark < 0) continue;
    const LandmarkId landmark = belief_.map.find(observations[i].landmark);
    if (landmark < 0)
      seen_.unmapped.push_back(i);
    else
      seen_.matched.push_back({i, landmark, reading_terms(observations[i], sensor_)});
  }
  association_.collect(observations);
  if (!seen_.matched.empty() || association_.sees_something())
    gating_sample_.select({particles.poses, particles.systematic, belief_.pending.prediction(),
                           particles.weights, particles.best(), belief_.pending.covariance(),
                           sensor_.body_from_sensor});
  std::erase_if(seen_.matched, [&](const MatchedSighting& s) {
    const GatingSample::Gated gated =
        gating_sample_.gate(s.reading, belief_.map.stored(s.landmark, particles.ancestry), options_.gate);
    report_.observations[s.observation] = {gated.rejected ? Decision::rejected : Decision::matched,
                                           gated.rejected ? kUnknownLandmark : belief_.map.id_of(s.landmark),
                                           gated.innovation, gated.nis};
    return gated.rejected;
  });
}

bool ParticleSlam::sees_something() const {
  return !seen_.matched.empty() || !seen_.unmapped.empty() || association_.sees_something();
}

/// The landmarks that are seen will be needed by all particles; sensors are counted from where they are.
void ParticleSlam::request_landmarks() {
  ParticleSet& particles = belief_.particles;
  predict(particles.poses, particles.systematic, belief_.pending.prediction(), {0, kParticleLanes},
          particles.predicted);
  particles.sensors.origin = particles.predicted.at(0).translation();
  seen_.readings.clear();
  for (const MatchedSighting& s : seen_.matched) {
    seen_.readings.push_back({s.reading, &belief_.map.request(s.landmark, particles.ancestry)});
    belief_.map.count_sighting(s.landmark);
  }
}

/// Eq. 9; and what unidentified sightings show each particle: one that is drawn from the motion alone is
/// drawn by then, any other stands at its prediction, as unsure as the motion.
void ParticleSlam::predict_and_associate(const Draw& draw, const Placement& by_motion) {
  request_landmarks();
  ParticleSet& particles = belief_.particles;
  Matrix3 L = by_motion.L, unsure = belief_.pending.covariance();
  (proposal_.is_motion() ? unsure : L).setZero();
  const Matrix3 Ad = adjoint(sensor_.body_from_sensor.inverse());
  const ParticleAssociation::Sampling sampling{Ad * unsure * Ad.transpose(), draw};
  association_.find_candidates(belief_, gating_sample_);
  thread_pool_.for_all_particles([&](ParticleRange block) {
    predict(particles.poses, particles.systematic, belief_.pending.prediction(), block, particles.predicted);
    belief_.map.gather(block);
    draw_normals(draw, block, particles.noise);
    place(particles.predicted, particles.noise, {L, sensor_.body_from_sensor}, block, particles.poses,
          particles.sensors);
    association_.associate(sampling, particles, block);
  });
  belief_.map.end_gather();
  association_.resolve(sampling.sensor_covariance, particles.sensors, seen_.readings);
  seen_.near.set(seen_.readings, particles.sensors.origin);
}

/// Eq. 15 and 16, then 11 to 13: all of it for one block of the particles, while that is in the cache.
void ParticleSlam::propose_and_weigh(const PoseProposal::Step& proposal, ParticleRange block) {
  ParticleSet& particles = belief_.particles;
  proposal_.draw(proposal, block, particles);
  weigh_and_improve(seen_.near, particles.sensors, block, particles.log_weights.data());
}

/// Unidentified sightings update the map before named landmarks are added, and those they show after it.
void ParticleSlam::create_landmarks(std::span<const Observation> observations) {
  const bool has_unidentified = association_.sees_something();
  if (has_unidentified) association_.update_map(belief_, gating_sample_, report_);
  for (const std::size_t i : seen_.unmapped) add_landmark(observations[i], i);
  if (has_unidentified) association_.create(belief_, gating_sample_, report_);
}

/// A landmark seen for the first time; a second sighting of it in the same step improves it.
void ParticleSlam::add_landmark(const Observation& observation, std::size_t index) {
  ParticleSet& particles = belief_.particles;
  ParticleMap& map = belief_.map;
  const ReadingTerms reading = reading_terms(observation, sensor_);
  ObservationReport& report = report_.observations[index];
  report.landmark = observation.landmark;
  if (const LandmarkId known = map.find(observation.landmark); known >= 0) {
    report.decision = Decision::matched;
    const KnownReading again{reading, &map.current(known, particles.ancestry)};
    weigh_and_improve({{&again, 1}, particles.sensors.origin}, particles.sensors, particles.all(),
                      particles.log_weights.data());
    return map.count_sighting(known);
  }
  report.decision = Decision::created;
  const LandmarkEstimate near =
      first_estimate(sensor_at(particles.poses.at(0), sensor_.body_from_sensor), reading);
  const LandmarkId landmark = map.add(observation.landmark, {near.x, near.y}, particles.ancestry);
  set_first_estimates(reading, particles.sensors, particles.all(), map.current(landmark, particles.ancestry));
}

void ParticleSlam::normalise_weights() {
  report_.effective_particles = normalise(belief_.particles);
  report_.greatest_weight = belief_.particles.weights[belief_.particles.leading];
}

void ParticleSlam::resample_if_poor() {
  const double limit = options_.resample_below * static_cast<double>(options_.particles);
  report_.resampled = report_.effective_particles < limit;
  if (!report_.resampled) return;
  resampling_.resample(belief_.particles);
  belief_.paths.resampled(belief_.particles.ancestry);
}

void ParticleSlam::read_bias(const BiasReading& reading) {
  if (belief_.pending.systematic() == 0) return;
  trundle::slam::read_bias(reading, belief_);
  normalise_weights();
}

PoseEstimate ParticleSlam::estimate() const {
  PoseEstimate estimate = mean_of(belief_.particles, belief_.pending);
  if (options_.estimate == PointEstimate::mean) return estimate;
  const Pose2 pose = pose_of(belief_.particles.leading, belief_.particles, belief_.pending);
  const Vector3 apart(pose.x - estimate.pose.x, pose.y - estimate.pose.y,
                      wrap_angle(pose.heading - estimate.pose.heading));
  estimate.pose = pose;
  estimate.covariance += apart * apart.transpose();
  return estimate;
}

MappedLandmark ParticleSlam::landmark(std::size_t index) const {
  return belief_.map.mixture(static_cast<LandmarkId>(index), belief_.particles.weights,
                             belief_.particles.ancestry);
}

bool ParticleSlam::has_landmark(std::size_t index) const {
  return belief_.map.has(static_cast<LandmarkId>(index), belief_.particles.best(),
                         belief_.particles.ancestry);
}

std::vector<Pose2> ParticleSlam::poses() const {
  std::vector<Pose2> poses;
  for (std::size_t i = 0; i < options_.particles; ++i) poses.push_back(belief_.particles.poses.at(i));
  return poses;
}

std::vector<double> ParticleSlam::weights() const {
  const Column<double>& weights = belief_.particles.weights;
  return {weights.begin(), weights.begin() + static_cast<std::ptrdiff_t>(options_.particles)};
}

std::vector<Pose2> ParticleSlam::best_path() const {
  const std::size_t best = belief_.particles.best();
  return belief_.paths.path_of(
      {static_cast<Ancestry::Index>(best), options_.prior.start, belief_.particles.systematic.at(best)},
      belief_.particles.ancestry);
}

}  // namespace trundle::slam
