#include "trundle/slam/fastslam/particle_slam.hpp"

#include <algorithm>

#include <Eigen/Cholesky>

#include "trundle/io/error.hpp"
#include "trundle/slam/cholesky.hpp"
#include "trundle/slam/fastslam/pose_target.hpp"

namespace trundle::slam {
namespace {

ParticleBelief belief_at(const SlamPrior& prior, const ParticleSlamOptions& options) {
  const Systematic& sigma = prior.systematic_sigma;
  return {.particles = {options.particles, sigma.size()},
          .map = {options.particles, options.map_precision, options.first_unidentified},
          .paths = {},
          .pending = PendingMotion(sigma),
          .keeps_paths = options.keep_paths};
}

}  // namespace

ParticleSlam::ParticleSlam(const LandmarkSensor& sensor, const ParticleSlamOptions& options)
    : sensor_(sensor),
      options_(options),
      thread_pool_(options.threads, options.particles),
      belief_(belief_at(options.prior, options)),
      proposal_(options.proposal, options.swarm, options.particles),
      resampling_(options.seed, options.particles),
      gating_sample_(options.particles, options.map_precision, options.prior.systematic_sigma.size()),
      association_(sensor, {options.particles, options.map_precision}),
      common_error_(sensor, options.particles) {
  if (options.particles == 0) throw InputError("particle filter", "has 0 particles", "at least 1");
  ParticleSet& particles = belief_.particles;
  const Pose2& start = options.prior.start;
  for (std::size_t i = 0; i < particles.all().last; ++i) particles.predicted.set(i, start);
  draw_normals(next_draw(), particles.all(), particles.noise);
  const Matrix3 L = semidefinite_root(body_covariance(start, options.prior.start_covariance));
  place(particles.predicted, particles.noise, {L, sensor.body_from_sensor}, particles.all(), particles.poses,
        particles.sensors);
  weigh();
}

const StepReport& ParticleSlam::step(const Motion& motion, std::span<const Observation> observations) {
  report_.observations.assign(observations.size(), {});
  report_.resampled = report_.closed_loop = false;
  predict(motion, belief_);
  common_error_.predict(motion, belief_);
  gate(observations);
  common_error_.add_sightings(matched_, report_, belief_);
  if (sees_something()) {
    propose_and_weigh();  // associate, propose, weigh, update
    learn_systematic(belief_);
    create_landmarks(observations);
    weigh();
    add_keyframe(common_error_.drift(), belief_);
    resample_if_poor();
  } else {
    propagate(belief_);
  }
  if (const auto closed = common_error_.close_loop(observations, report_, belief_)) {
    correct_loop(*closed, next_draw(), belief_);
    report_.closed_loop = true;
  }
  return report_;
}

/// Eq. 14: observations of landmarks in the map that are no outliers, and those of others. Reports what the
/// most probable particle finds, before this step has moved or weighed any.
void ParticleSlam::gate(std::span<const Observation> observations) {
  ParticleSet& particles = belief_.particles;
  matched_.clear();
  unmapped_.clear();
  for (std::size_t i = 0; i < observations.size(); ++i) {
    if (!is_valid(observations[i]) || observations[i].landmark < 0) continue;
    const LandmarkId landmark = belief_.map.find(observations[i].landmark);
    if (landmark < 0)
      unmapped_.push_back(i);
    else
      matched_.push_back({i, landmark, reading_terms(observations[i], sensor_)});
  }
  association_.collect(observations);
  if (!matched_.empty() || association_.sees_something())
    gating_sample_.select({particles.poses, particles.systematic, belief_.pending.prediction(),
                           particles.weights, particles.best(), belief_.predicted_covariance(),
                           sensor_.body_from_sensor});
  std::erase_if(matched_, [&](const MatchedSighting& s) {
    const GatingSample::Gated gated =
        gating_sample_.gate(s.reading, belief_.map.inherited(s.landmark, particles.ancestry), options_.gate);
    report_.observations[s.observation] = {gated.rejected ? Decision::rejected : Decision::matched,
                                           gated.rejected ? kUnknownLandmark : belief_.map.id_of(s.landmark),
                                           gated.innovation, gated.nis};
    return gated.rejected;
  });
}

bool ParticleSlam::sees_something() const {
  return !matched_.empty() || !unmapped_.empty() || association_.sees_something();
}

/// Poses are drawn, take their weights and improve their landmarks: all of it for one block of the particles
/// at a time, unless something has to be decided about all of them in between.
void ParticleSlam::propose_and_weigh() {
  ParticleSet& particles = belief_.particles;
  const Placement placement{semidefinite_root(belief_.predicted_covariance()), sensor_.body_from_sensor};
  const Draw draw = next_draw();
  const PoseProposal::Step step{near_, placement, next_draw()};
  expect_landmarks();
  const bool is_associated = associate(draw);
  const bool is_up = is_associated || proposal_.needs_all();
  if (is_up && !is_associated)
    thread_pool_.for_all_particles([&](ParticleRange block) { predict_range(draw, block); });
  association_.add_readings(readings_);
  near_.set(readings_, particles.sensors.origin);
  proposal_.refine(step, thread_pool_, particles);
  const bool is_placed = is_associated && proposal_.is_motion();
  thread_pool_.for_all_particles([&](ParticleRange block) {
    if (!is_up) predict_range(draw, block);
    proposal_.draw(step, block, particles);
    if (!is_placed)
      place(particles.predicted, particles.noise, placement, block, particles.poses, particles.sensors);
    weigh_and_improve(near_, particles.sensors, block, particles.log_weights.data());
  });
  belief_.map.all_have_inherited();
}

/// The landmarks that are seen will be needed by all particles; sensors are counted from where they are.
void ParticleSlam::expect_landmarks() {
  ParticleSet& particles = belief_.particles;
  predict(particles.poses, particles.systematic, belief_.pending.prediction(), {0, kParticleLanes},
          particles.predicted);
  particles.sensors.origin = particles.predicted.at(0).translation();
  readings_.clear();
  for (const MatchedSighting& s : matched_) {
    readings_.push_back({s.reading, &belief_.map.expect(s.landmark, particles.ancestry)});
    belief_.map.count_sighting(s.landmark);
  }
}

/// Each particle finds out what sightings without names show: where it will be drawn if that depends on the
/// motion alone, else at its prediction with the motion's uncertainty. False where there are none.
bool ParticleSlam::associate(const Draw& draw) {
  if (!association_.sees_something()) return false;
  ParticleSet& particles = belief_.particles;
  const Matrix3& covariance = belief_.predicted_covariance();
  const bool stays = proposal_.is_motion();
  const Matrix3 Ad = adjoint(sensor_.body_from_sensor.inverse());
  const Matrix3 L = stays ? semidefinite_root(covariance) : Matrix3(Matrix3::Zero());
  const Matrix3 unsure = stays ? Matrix3(Matrix3::Zero()) : Matrix3(Ad * covariance * Ad.transpose());
  const ParticleAssociation::View view{
      particles.sensors, unsure, particles.best(), draw, particles.log_weights.data(), gating_sample_};
  association_.look_up(view, belief_.map, particles.ancestry);
  thread_pool_.for_all_particles([&](ParticleRange block) {
    predict_range(draw, block);
    place(particles.predicted, particles.noise, {L, sensor_.body_from_sensor}, block, particles.poses,
          particles.sensors);
    association_.choose(view, block);
  });
  association_.decide(view);
  return true;
}

/// Predictions, the landmarks that will be needed, and random numbers, up to this step.
void ParticleSlam::predict_range(const Draw& draw, ParticleRange range) {
  ParticleSet& particles = belief_.particles;
  predict(particles.poses, particles.systematic, belief_.pending.prediction(), range, particles.predicted);
  belief_.map.inherit(range);
  draw_normals(draw, range, particles.noise);
}

/// Sightings without names find their way back into the map; then come the landmarks that are new.
void ParticleSlam::create_landmarks(std::span<const Observation> observations) {
  ParticleSet& particles = belief_.particles;
  const auto add_named = [&] {
    for (const std::size_t i : unmapped_) add_landmark(observations[i], i);
  };
  if (!association_.sees_something()) return add_named();
  const auto best = static_cast<std::size_t>(std::ranges::max_element(particles.log_weights) -
                                             particles.log_weights.begin());
  const Pose2 sensor = particles.poses.at(best) * sensor_.body_from_sensor;
  const ParticleAssociation::Drawn drawn{particles.sensors, sensor, particles.log_weights.data(),
                                         particles.weights, gating_sample_};
  association_.update_map(drawn, belief_.map, particles.ancestry, report_);
  add_named();
  association_.create(drawn, belief_.map, particles.ancestry, report_);
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

void ParticleSlam::weigh() {
  report_.effective_particles = normalise(belief_.particles);
  report_.greatest_weight = belief_.particles.weights[belief_.particles.leading];
}

void ParticleSlam::resample_if_poor() {
  const double limit = options_.resample_below * static_cast<double>(options_.particles);
  if (report_.effective_particles >= limit) return;
  common_error_.before_resampling(belief_);
  resampling_.resample(belief_.particles);
  if (belief_.keeps_paths) belief_.paths.resampled(belief_.particles.ancestry);
  report_.resampled = true;
  common_error_.after_resampling(report_, belief_);
}

void ParticleSlam::read_bias(const BiasReading& reading) {
  if (belief_.pending.systematic() == 0) return;
  trundle::slam::read_bias(reading, belief_);
  weigh();
}

PoseEstimate ParticleSlam::estimate() const {
  PoseEstimate estimate = common_error_.estimate(belief_);
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
                             belief_.particles.ancestry, common_error_.lost());
}

bool ParticleSlam::has_landmark(std::size_t index) const {
  return belief_.map.has(static_cast<LandmarkId>(index), belief_.particles.best(),
                         belief_.particles.ancestry);
}

std::vector<Pose2> ParticleSlam::poses() const {
  return poses_of(belief_.particles);
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
