#include "trundle/slam/localization/pose_particles.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <tuple>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "trundle/geometry/gaussian.hpp"
#include "trundle/slam/cholesky.hpp"

namespace trundle::slam {
namespace {

/// Counts the bins that poses fall into.
class Bins {
 public:
  explicit Bins(const ParticleNumber& number) : number_(number) {}
  void add(const Pose2& pose) {
    filled_.insert({std::llround(pose.x / number_.bin_m), std::llround(pose.y / number_.bin_m),
                    std::llround(wrap_angle(pose.heading) / number_.bin_rad)});
  }
  std::size_t count() const { return filled_.size(); }

 private:
  const ParticleNumber& number_;
  std::set<std::tuple<long long, long long, long long>> filled_;
};

/// How the mean of the systematic errors depends on where the pose is, and their covariance once it is known.
Eigen::Matrix<double, Eigen::Dynamic, 3, 0, kMostSystematic, 3> systematic_by_pose(
    const PoseEstimate& belief) {
  return Eigen::LDLT<Matrix3>(belief.covariance).solve(belief.with_systematic).transpose();
}
SystematicCovariance given_pose(const PoseEstimate& belief) {
  return belief.systematic_covariance - systematic_by_pose(belief) * belief.with_systematic;
}

/// Which of several, by the cumulative sum of their weights.
std::size_t chosen(std::span<const double> cumulative, double point) {
  const auto at = std::ranges::upper_bound(cumulative, point * cumulative.back());
  return std::min(static_cast<std::size_t>(at - cumulative.begin()), cumulative.size() - 1);
}

}  // namespace

// Eq. 50, with the normal approximation of χ².
std::size_t particles_for(std::size_t bins, const ParticleNumber& number) {
  const std::size_t least = std::min(number.least, number.most);
  if (bins < 2) return least;
  const double k = static_cast<double>(bins) - 1.0;
  const double third = 2.0 / (9.0 * k);
  const double root = 1.0 - third + std::sqrt(third) * normal_quantile(1.0 - number.tail);
  const double wanted = k / (2.0 * number.error) * root * root * root;
  return std::clamp(static_cast<std::size_t>(wanted), least, number.most);
}

PoseParticles::PoseParticles(const KnownMap& map, const LandmarkSensor& sensor, const PoseEstimate& start,
                             const PoseParticlesOptions& options)
    : map_(&map),
      sensor_(sensor),
      options_(options),
      random_(options.seed),
      pending_(start.systematic, start.systematic_covariance),
      estimate_(start) {
  Bins bins(options.number);
  while (poses_.size() < particles_for(bins.count(), options.number)) {
    poses_.push_back(draw_from(start));
    bins.add(poses_.back());
  }
  log_weights_.assign(poses_.size(), 0.0);
  normalise();
  begin_pending();
  become_kernels();
}

Pose2 PoseParticles::draw_from(const PoseEstimate& belief) {
  const double a = random_.normal();
  const double b = random_.normal();
  const Vector3 e = semidefinite_root(belief.covariance) * Vector3(a, b, random_.normal());
  return {belief.pose.x + e.x(), belief.pose.y + e.y(), belief.pose.heading + e.z()};
}

PoseEstimate PoseParticles::predicted(std::size_t particle) const {
  const PredictedMotion motion = pending_.prediction();
  PoseEstimate belief;
  belief.pose = poses_[particle] * motion.mean *
                exp(Twist2::from(motion.by_systematic * systematic_[particle] + motion.offset));
  belief.covariance = world_covariance({belief.pose, pending_.covariance()});
  if (pending_.systematic() == 0) return belief;
  belief.systematic = pending_.systematic_of(systematic_[particle]);
  belief.systematic_covariance = pending_.systematic_covariance();
  belief.with_systematic = world_from_body_axes(belief.pose) * pending_.with_systematic();
  return belief;
}

/// Eq. 10b: particles that have come where they are with another bias are less likely.
void PoseParticles::read_bias(const BiasReading& reading) {
  if (pending_.systematic() == 0) return;
  for (std::size_t i = 0; i < poses_.size(); ++i)
    log_weights_[i] += pending_.log_likelihood(reading, systematic_[i]);
  pending_.read(reading);
  normalise();
  trundle::slam::read_bias(reading, estimate_);
}

/// Eq. 51a: what is known of the systematic errors of a robot that is at a particle's pose. Were it what the
/// particle's own past says, particles of one ancestor would be as sure of it as that one was, and the set
/// would forget the others: what does not change has to be carried by all of them together.
void PoseParticles::begin_pending() {
  systematic_.assign(poses_.size(), Systematic(pending_.systematic()));
  if (pending_.systematic() == 0) return pending_.drawn(Systematic(0));
  const auto by_pose = systematic_by_pose(estimate_);
  for (std::size_t i = 0; i < poses_.size(); ++i)
    systematic_[i] = estimate_.systematic + by_pose * difference(estimate_.pose, poses_[i]);
  pending_ = PendingMotion(estimate_.systematic, given_pose(estimate_));
}

const MapStepReport& PoseParticles::step(const Motion& motion, std::span<const Observation> observations,
                                         std::span<const double> novelty) {
  report_.observations.assign(observations.size(), {});
  report_.against = report_.new_evidence_against = 0.0;
  report_.particles = poses_.size();
  pending_.add(motion);
  const bool any =
      std::ranges::any_of(observations, [&](const Observation& o) { return may_be_mapped(o, *map_); });
  if (!any) {
    estimate_ = moved(estimate_, motion);
    return report_;
  }
  std::vector<PoseEstimate> beliefs;
  std::vector<Pose2> drawn;
  double all = 0.0;
  double new_evidence = 0.0;
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    beliefs.push_back(predicted(i));
    const Fitting here = improve(beliefs[i], observations, novelty, i == 0);
    drawn.push_back(draw_from(beliefs[i]));
    all += weights_[i] * std::exp(std::min(here.log_all, 700.0));
    new_evidence += weights_[i] * std::exp(std::min(here.log_new_evidence, 700.0));
    log_weights_[i] += here.log_all;
  }
  report_.against = -std::log(std::max(all, std::numeric_limits<double>::min()));
  report_.new_evidence_against = -std::log(std::max(new_evidence, std::numeric_limits<double>::min()));
  poses_ = std::move(drawn);
  normalise();
  mix(beliefs);
  if (effective_particles() < options_.resample_below * static_cast<double>(poses_.size())) resample();
  begin_pending();
  return report_;
}

/// Eq. 51: a Gaussian of the motion, improved by the sightings one by one.
PoseParticles::Fitting PoseParticles::improve(PoseEstimate& belief, std::span<const Observation> observations,
                                              std::span<const double> novelty, bool reports) {
  const auto landmarks = identify(belief, *map_, sensor_, observations, options_.sight.gate);
  const double in_view = map_->most_in_view();
  Fitting here;
  for (std::size_t k = 0; k < observations.size(); ++k) {
    if (!may_be_mapped(observations[k], *map_)) continue;
    std::optional<MapSight> sight;
    if (landmarks[k] != kUnknownLandmark)
      sight = map_sight(belief, sensor_, (*map_)[landmarks[k]], observations[k]);
    const GatedReading reading =
        gated(observations[k], landmarks[k], sight ? &*sight : nullptr, in_view, sensor_, options_.sight);
    if (reading.report.decision == Decision::matched) {
      const Matrix2& L = sight->expected.by_landmark;
      const Matrix2 noise =
          L * (*map_)[landmarks[k]].covariance * L.transpose() + reading_covariance(sensor_);
      update({sight->innovation, sight->expected.by_pose, sight->S, noise}, belief);
    }
    if (reports) report_.observations[k] = reading.report;
    here.log_all -= reading.against;
    here.log_new_evidence -= novelty[k] * reading.against;
  }
  return here;
}

void PoseParticles::normalise() {
  const double largest = *std::ranges::max_element(log_weights_);
  weights_.resize(log_weights_.size());
  double sum = 0.0;
  for (std::size_t i = 0; i < weights_.size(); ++i) {
    log_weights_[i] -= largest;
    sum += weights_[i] = std::exp(log_weights_[i]);
  }
  for (double& weight : weights_) weight /= sum;
}

double PoseParticles::effective_particles() const {
  double squares = 0.0;
  for (const double weight : weights_) squares += weight * weight;
  return 1.0 / squares;
}

void PoseParticles::resample() {
  std::vector<double> cumulative;
  double sum = 0.0;
  for (const double weight : weights_) cumulative.push_back(sum += weight);
  std::vector<Pose2> drawn;
  Bins bins(options_.number);
  while (drawn.size() < particles_for(bins.count(), options_.number)) {
    drawn.push_back(poses_[chosen(cumulative, random_.uniform())]);
    bins.add(drawn.back());
  }
  poses_ = std::move(drawn);
  spread();
  log_weights_.assign(poses_.size(), 0.0);
  normalise();
}

/// Eq. 52: how wide the kernels are that so many particles stand for, as a share of their spread.
double PoseParticles::kernel_width() const {
  constexpr double kDimensions = 3.0;  // x, y, heading
  return std::pow(4.0 / ((kDimensions + 2.0) * static_cast<double>(poses_.size())),
                  1.0 / (kDimensions + 4.0));
}

/// Moves each particle so much towards the mean that, with a kernel about each, the spread stays.
void PoseParticles::make_room_for_kernels() {
  const double h = kernel_width();
  const double keep = std::sqrt(1.0 - h * h);
  const Pose2& mean = estimate_.pose;
  for (Pose2& pose : poses_)
    pose = {mean.x + keep * (pose.x - mean.x), mean.y + keep * (pose.y - mean.y),
            mean.heading + keep * wrap_angle(pose.heading - mean.heading)};
}

/// Of a start that is vague beside the first sightings hardly a particle is where they fit: each stands for a
/// kernel, which the sightings improve as they do a motion.
void PoseParticles::become_kernels() {
  make_room_for_kernels();
  const double h = kernel_width();
  Motion kernel;
  kernel.covariance = h * h * body_covariance(estimate_.pose, estimate_.covariance);
  pending_.add(kernel);
}

/// Eq. 52: moves each particle a little towards the mean and scatters it by as much, so that mean and
/// covariance stay and no two particles do. A robot that stands still and looks around has no motion noise to
/// distinguish them.
void PoseParticles::spread() {
  make_room_for_kernels();
  const double h = kernel_width();
  PoseEstimate kernel;
  kernel.covariance = h * h * estimate_.covariance;
  for (Pose2& pose : poses_) {
    kernel.pose = pose;
    pose = draw_from(kernel);
  }
}

/// Eq. 17 for poses; headings are averaged as differences to the best particle's.
void PoseParticles::mix(std::span<const PoseEstimate> beliefs) {
  const auto best = static_cast<std::size_t>(std::ranges::max_element(weights_) - weights_.begin());
  const Pose2 about = beliefs[best].pose;
  const auto apart_of = [&](const PoseEstimate& belief) {
    return Vector3(belief.pose.x - about.x, belief.pose.y - about.y,
                   wrap_angle(belief.pose.heading - about.heading));
  };
  Vector3 mean = Vector3::Zero();
  for (std::size_t i = 0; i < beliefs.size(); ++i) mean += weights_[i] * apart_of(beliefs[i]);
  estimate_.pose = {about.x + mean.x(), about.y + mean.y(), about.heading + mean.z()};
  estimate_.covariance.setZero();
  const Eigen::Index n = pending_.systematic();
  estimate_.systematic = Systematic::Zero(n);
  estimate_.systematic_covariance = SystematicCovariance::Zero(n, n);
  estimate_.with_systematic = BySystematic::Zero(3, n);
  if (n > 0)
    for (std::size_t i = 0; i < beliefs.size(); ++i)
      estimate_.systematic += weights_[i] * beliefs[i].systematic;
  for (std::size_t i = 0; i < beliefs.size(); ++i) {
    const Vector3 apart = apart_of(beliefs[i]) - mean;
    estimate_.covariance += weights_[i] * (beliefs[i].covariance + apart * apart.transpose());
    if (n == 0) continue;
    const Systematic unlike = beliefs[i].systematic - estimate_.systematic;
    estimate_.systematic_covariance +=
        weights_[i] * (beliefs[i].systematic_covariance + unlike * unlike.transpose());
    estimate_.with_systematic += weights_[i] * (beliefs[i].with_systematic + apart * unlike.transpose());
  }
}

}  // namespace trundle::slam
