#include "trundle/slam/particle_slam.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "trundle/io/error.hpp"
#include "trundle/slam/cholesky.hpp"

namespace trundle {
namespace {

/// So many particles, spread over all, decide what an outlier is.
constexpr std::size_t kJury = 32;

Matrix3 pose_root(const Pose2& pose, const Matrix3& covariance_in_world) {
  return semidefinite_root(body_covariance(pose, covariance_in_world));
}

}  // namespace

ParticleSlam::ParticleSlam(const LandmarkSensor& sensor, const ParticleSlamOptions& options)
    : sensor_(sensor),
      options_(options),
      poses_(options.particles, options.prior.start),
      sensors_(options.particles),
      log_weights_(options.particles, 0.0),
      weights_(options.particles),
      ancestry_(options.particles),
      map_(options.particles),
      systematic_(options.particles, Systematic::Zero()),
      systematic_covariance_(options.prior.systematic_sigma.cwiseAbs2().asDiagonal()) {
  if (options.particles == 0) throw InputError("particle filter", "has 0 particles", "at least 1");
  const std::size_t blocks = (options.particles + kParticleBlock - 1) / kParticleBlock;
  for (std::size_t block = 0; block <= blocks; ++block) random_.emplace_back(options.seed, block);
  const Pose2& start = options.prior.start;
  const Matrix3 L = pose_root(start, options.prior.start_covariance);
  for (std::size_t i = 0; i < poses_.size(); ++i) poses_[i] = start * exp(Twist2::from(L * normal_of(i)));
  normalise();
}

const StepReport& ParticleSlam::step(const Motion& motion, std::span<const Observation> observations) {
  report_.observations.assign(observations.size(), {});
  report_.resampled = false;
  pending_ = pending_ * motion;
  std::vector<std::size_t> open;
  std::vector<Seen> seen = recognise(observations, open);
  const std::vector<Pose2> poses = predicted();
  reject_outliers(poses, seen);
  if (seen.empty() && open.empty()) {
    if (options_.keep_paths) paths_.coast(pending_);
    return report_;
  }
  propose(poses, seen);
  learn_systematic(poses);
  for (const Seen& s : seen) weigh(s);
  for (const std::size_t i : open) add_landmark(observations[i], i);
  normalise();
  if (options_.keep_paths) paths_.arrive(pending_, poses_, ancestry_);
  pending_ = {};
  const double limit = options_.resample_below * static_cast<double>(poses_.size());
  if (report_.effective_particles < limit) resample();
  return report_;
}

std::vector<Pose2> ParticleSlam::predicted() const {
  std::vector<Pose2> poses = poses_;
  for (std::size_t i = 0; i < poses.size(); ++i)
    poses[i] = poses[i] * pending_.mean * exp(Twist2::from(pending_.by_systematic * systematic_[i]));
  return poses;
}

/// Of the error of a particle's prediction: noise, and what is not known of the systematic errors. Eq. 9.
Matrix3 ParticleSlam::predicted_covariance() const {
  const Matrix3& S = pending_.by_systematic;
  return pending_.covariance + S * systematic_covariance_ * S.transpose();
}

/// A Kalman filter for each particle, given its path: the drawn pose is a measurement of S s. Eq. 10.
void ParticleSlam::learn_systematic(std::span<const Pose2> predicted) {
  const Eigen::LDLT<Matrix3> all(predicted_covariance());
  const Matrix3 SP = pending_.by_systematic * systematic_covariance_;
  const Matrix3 gain = all.solve(SP).transpose();
  for (std::size_t i = 0; i < poses_.size(); ++i)
    systematic_[i] += gain * log(predicted[i].inverse() * poses_[i]).vector();
  systematic_covariance_ -= gain * SP;
  systematic_covariance_ = (0.5 * (systematic_covariance_ + systematic_covariance_.transpose())).eval();
}

/// Observations of landmarks in the map, whose columns are brought up to now; the valid rest stays open.
std::vector<ParticleSlam::Seen> ParticleSlam::recognise(std::span<const Observation> observations,
                                                        std::vector<std::size_t>& open) {
  std::vector<Seen> seen;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    if (!is_valid(observations[i]) || observations[i].landmark < 0) continue;
    const LandmarkId landmark = map_.find(observations[i].landmark);
    if (landmark < 0)
      open.push_back(i);
    else
      seen.push_back(
          {i, landmark, {reading_terms(observations[i], sensor_), &map_.current(landmark, ancestry_)}});
  }
  return seen;
}

/// Eq. 14. Reports what the most probable particle finds, before this step has moved or weighted any.
void ParticleSlam::reject_outliers(std::span<const Pose2> predicted, std::vector<Seen>& seen) {
  const PoseTarget target(predicted, predicted_covariance(), sensor_.body_from_sensor, {});
  const std::size_t stride = (poses_.size() + kJury - 1) / kJury;
  const std::size_t reporter = best_particle();
  std::erase_if(seen, [&](const Seen& s) {
    double against = 0.0;
    double all = 0.0;
    for (std::size_t i = 0; i < poses_.size(); i += stride) {
      all += weights_[i];
      if (target.surprise(i, s.known).nis > options_.gate) against += weights_[i];
    }
    const bool rejected = against > 0.5 * all;
    const PoseTarget::Surprise surprise = target.surprise(reporter, s.known);
    report_.observations[s.observation] = {rejected ? Decision::rejected : Decision::matched,
                                           rejected ? kUnknownLandmark : s.landmark, surprise.innovation,
                                           surprise.nis};
    return rejected;
  });
}

Vector3 ParticleSlam::normal_of(std::size_t particle) {
  Random& random = random_of(particle);
  const double x = random.normal();
  const double y = random.normal();
  return {x, y, random.normal()};
}

void ParticleSlam::propose(std::span<const Pose2> predicted, std::span<const Seen> seen) {
  std::vector<KnownReading> readings;
  for (const Seen& s : seen) readings.push_back(s.known);
  const PoseTarget target(predicted, predicted_covariance(), sensor_.body_from_sensor, readings);
  const Proposal proposal = options_.proposal;
  const bool by_swarm = proposal == Proposal::swarm || proposal == Proposal::swarm_gaussian;
  const bool by_gaussian = proposal == Proposal::linearised || proposal == Proposal::swarm_gaussian;
  std::vector<Vector3> n(poses_.size(), Vector3::Zero());
  if (proposal != Proposal::linearised || !target.sees_something())
    for (std::size_t i = 0; i < n.size(); ++i) n[i] = normal_of(i);
  if (by_swarm) refine_by_swarm(target, options_.swarm, random_, n);
  if (by_gaussian && target.sees_something())
    for (std::size_t i = 0; i < n.size(); ++i) sample_gaussian(target, i, n[i]);
  for (std::size_t i = 0; i < n.size(); ++i) {
    poses_[i] = target.pose(i, n[i]);
    sensors_[i] = sensor_at(poses_[i], sensor_.body_from_sensor);
  }
}

/// Eq. 16: n becomes a draw from the Gaussian at n; the weight takes prior/proposal.
void ParticleSlam::sample_gaussian(const PoseTarget& target, std::size_t particle, Vector3& n) {
  const WhitenedGaussian q = target.gaussian_near(particle, n);
  const Vector3 z = normal_of(particle);
  n = q.mean + q.information_root.transpose().triangularView<Eigen::Upper>().solve(z);
  log_weights_[particle] +=
      0.5 * (z.squaredNorm() - n.squaredNorm()) - q.information_root.diagonal().array().log().sum();
}

void ParticleSlam::weigh(const Seen& seen) {
  LandmarkColumns& columns = map_.current(seen.landmark, ancestry_);
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    LandmarkEstimate m = columns.at(i);
    const Sight sight = sight_of(sensors_[i], seen.known.reading, m);
    log_weights_[i] += log_likelihood_of(sight);
    improve(m, sight);
    columns.set(i, m);
  }
  map_.count_sighting(seen.landmark);
}

/// A landmark seen for the first time; a second sighting of it in the same step improves it.
void ParticleSlam::add_landmark(const Observation& observation, std::size_t index) {
  const ReadingTerms reading = reading_terms(observation, sensor_);
  ObservationReport& report = report_.observations[index];
  report.landmark = map_.find(observation.landmark);
  if (report.landmark >= 0) {
    report.decision = Decision::matched;
    return weigh({index, report.landmark, {reading, nullptr}});
  }
  report.decision = Decision::created;
  report.landmark = map_.add(observation.landmark, ancestry_);
  LandmarkColumns& columns = map_.current(report.landmark, ancestry_);
  for (std::size_t i = 0; i < poses_.size(); ++i) columns.set(i, first_estimate(sensors_[i], reading));
}

void ParticleSlam::normalise() {
  const double largest = *std::ranges::max_element(log_weights_);
  double sum = 0.0;
  for (std::size_t i = 0; i < weights_.size(); ++i) {
    log_weights_[i] -= largest;
    weights_[i] = std::exp(log_weights_[i]);
    sum += weights_[i];
  }
  double squares = 0.0;
  for (double& weight : weights_) {
    weight /= sum;
    squares += weight * weight;
  }
  report_.effective_particles = 1.0 / squares;
}

/// Headings are averaged as differences to the best particle's.
PoseEstimate ParticleSlam::estimate() const {
  const std::vector<Pose2> poses = predicted();
  const double heading = poses[best_particle()].heading;
  const auto numbers_of = [&](const Pose2& pose) {
    return Vector3(pose.x, pose.y, heading + wrap_angle(pose.heading - heading));
  };
  Vector3 mean = Vector3::Zero();
  for (std::size_t i = 0; i < poses.size(); ++i) mean += weights_[i] * numbers_of(poses[i]);
  PoseEstimate estimate;
  estimate.pose = {mean.x(), mean.y(), mean.z()};
  estimate.covariance = world_covariance({estimate.pose, predicted_covariance()});
  for (std::size_t i = 0; i < poses.size(); ++i) estimate.systematic += weights_[i] * systematic_[i];
  estimate.systematic_covariance = systematic_covariance_;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Vector3 apart = numbers_of(poses[i]) - mean;
    estimate.covariance += weights_[i] * apart * apart.transpose();
    const Systematic unlike = systematic_[i] - estimate.systematic;
    estimate.systematic_covariance += weights_[i] * unlike * unlike.transpose();
  }
  return estimate;
}

/// Systematic: one random number, and as many children for each as its weight says, to within one.
void ParticleSlam::resample() {
  const auto count = poses_.size();
  std::vector<Ancestry::Index> parents(count);
  const double offset = random_.back().uniform();
  double sum = weights_[0];
  Ancestry::Index parent = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double point = (static_cast<double>(i) + offset) / static_cast<double>(count);
    while (sum < point && parent + 1 < count) sum += weights_[++parent];
    parents[i] = parent;
  }
  const std::vector<Pose2> before = poses_;
  const std::vector<Systematic> systematic_before = systematic_;
  for (std::size_t i = 0; i < count; ++i) {
    poses_[i] = before[parents[i]];
    systematic_[i] = systematic_before[parents[i]];
  }
  ancestry_.resample(parents);
  if (options_.keep_paths) paths_.resampled(ancestry_);
  std::ranges::fill(log_weights_, 0.0);
  std::ranges::fill(weights_, 1.0 / static_cast<double>(count));
  report_.resampled = true;
}

std::size_t ParticleSlam::best_particle() const {
  return static_cast<std::size_t>(std::ranges::max_element(log_weights_) - log_weights_.begin());
}

MappedLandmark ParticleSlam::landmark(std::size_t index) const {
  return map_.mixture(static_cast<LandmarkId>(index), weights_, ancestry_);
}

std::vector<double> ParticleSlam::weights() const {
  return weights_;
}

std::vector<Pose2> ParticleSlam::best_path() const {
  const std::size_t best = best_particle();
  return paths_.path_of({static_cast<Ancestry::Index>(best), options_.prior.start, systematic_[best]},
                        ancestry_);
}

}  // namespace trundle
