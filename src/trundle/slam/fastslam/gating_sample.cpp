#include "trundle/slam/fastslam/gating_sample.hpp"

#include <algorithm>
#include <limits>

#include "trundle/slam/fastslam/particle_kernels.hpp"

namespace trundle::slam {

GatingSample::GatingSample(std::size_t particles, Eigen::Index systematic)
    : particles_(particles),
      poses_(kMembers),
      systematic_(kMembers, systematic),
      predicted_(kMembers),
      still_(kMembers),
      sensors_(kMembers),
      whose_(kMembers),
      landmark_(kMembers),
      innovations_(kMembers) {
  members_.reserve(kMembers);
  weights_.reserve(kMembers);
}

void GatingSample::select(const Prior& prior) {
  members_.assign(1, prior.reporter);
  weights_.assign(1, 0.0);
  const std::size_t stride = (particles_ + kMembers - 2) / (kMembers - 1);
  for (std::size_t i = 0; i < particles_; i += stride) {
    members_.push_back(i);
    weights_.push_back(prior.weights[i]);
  }
  for (std::size_t member = 0; member < members_.size(); ++member) {
    poses_.set(member, prior.poses.at(members_[member]));
    systematic_.set(member, prior.systematic.at(members_[member]));
  }
  predict(poses_, systematic_, prior.motion, {0, kMembers}, predicted_);
  sensors_.origin = predicted_.at(1).translation();
  place(predicted_, still_, {Matrix3::Zero(), prior.body_from_sensor}, {0, kMembers}, predicted_, sensors_);
  const Matrix3 Ad = adjoint(prior.body_from_sensor.inverse());
  sensor_covariance_ = Ad * prior.predicted_covariance * Ad.transpose();
}

/// The landmark as the members have it.
void GatingSample::fetch(const ParticleMap::Stored& landmark) {
  for (std::size_t member = 0; member < members_.size(); ++member)
    whose_[member] = landmark.from[members_[member]];
  landmark_.count_from(landmark.columns.origin());
  gather_landmark(landmark.columns, whose_, {0, kMembers}, landmark_);
}

void GatingSample::set_innovations_of(const ReadingTerms& reading, const ParticleMap::Stored& landmark) {
  fetch(landmark);
  set_innovations({reading, &landmark_}, sensors_, sensor_covariance_, {0, kMembers}, innovations_);
}

GatingSample::Gated GatingSample::gate(const ReadingTerms& reading, const ParticleMap::Stored& landmark,
                                       double gate) {
  set_innovations_of(reading, landmark);
  double against = 0.0;
  double all = 0.0;
  for (std::size_t member = 1; member < members_.size(); ++member) {
    all += weights_[member];
    if (innovations_[2][member] > gate) against += weights_[member];
  }
  return {against > 0.5 * all, {innovations_[0][0], innovations_[1][0]}, innovations_[2][0]};
}

void GatingSample::add_to(Spread& spread, const LandmarkEstimate& m) const {
  const Vector2 place(m.x, m.y);
  if (!spread.is_any) spread.place = place;
  spread.is_any = true;
  spread.reach_m = std::max(spread.reach_m, (place - spread.place).norm());
  spread.sigma_m = std::max(spread.sigma_m, std::sqrt(m.xx + m.yy));
}

GatingSample::Spread GatingSample::spread_of(const ParticleMap::Stored& landmark) {
  fetch(landmark);
  Spread spread;
  for (std::size_t member = 0; member < members_.size(); ++member)
    if (const LandmarkEstimate m = landmark_.at(member); is_there(m)) add_to(spread, m);
  return spread;
}

GatingSample::Spread GatingSample::spread_of(const ReadingTerms& reading) const {
  Spread spread;
  for (std::size_t member = 0; member < members_.size(); ++member)
    add_to(spread, first_estimate(sensors_.in_world(member), reading));
  const Matrix3& C = sensor_covariance_;
  const double by_sensor = C(0, 0) + C(1, 1) + reading.range * reading.range * C(2, 2);
  spread.sigma_m = std::sqrt(spread.sigma_m * spread.sigma_m + by_sensor);
  return spread;
}

double GatingSample::least_nis(const ReadingTerms& reading, const ParticleMap::Stored& landmark) {
  set_innovations_of(reading, landmark);
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t member = 0; member < members_.size(); ++member)
    if (is_there(landmark_.at(member))) least = std::min(least, innovations_[2][member]);
  return least;
}

}  // namespace trundle::slam
