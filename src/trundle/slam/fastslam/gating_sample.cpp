#include "trundle/slam/fastslam/gating_sample.hpp"

#include <algorithm>
#include <limits>

#include "trundle/slam/fastslam/particle_kernels.hpp"

namespace trundle {

GatingSample::GatingSample(std::size_t particles, Precision precision, Eigen::Index systematic)
    : particles_(particles),
      poses_(kSeats),
      systematic_(kSeats, systematic),
      predicted_(kSeats),
      still_(kSeats),
      sensors_(kSeats),
      whose_(kSeats),
      landmark_(kSeats, precision),
      surprises_(kSeats) {
  jurors_.reserve(kSeats);
  votes_.reserve(kSeats);
}

void GatingSample::meet(const Case& at) {
  jurors_.assign(1, at.reporter);
  votes_.assign(1, 0.0);
  const std::size_t stride = (particles_ + kSeats - 2) / (kSeats - 1);
  for (std::size_t i = 0; i < particles_; i += stride) {
    jurors_.push_back(i);
    votes_.push_back(at.weights[i]);
  }
  for (std::size_t seat = 0; seat < jurors_.size(); ++seat) {
    poses_.set(seat, at.poses.at(jurors_[seat]));
    systematic_.set(seat, at.systematic.at(jurors_[seat]));
  }
  predict(poses_, systematic_, at.motion, {0, kSeats}, predicted_);
  sensors_.origin = predicted_.at(1).translation();
  place(predicted_, still_, {Matrix3::Zero(), at.body_from_sensor}, {0, kSeats}, predicted_, sensors_);
  const Matrix3 Ad = adjoint(at.body_from_sensor.inverse());
  sensor_covariance_ = Ad * at.predicted_covariance * Ad.transpose();
}

/// The landmark as jurors have it.
void GatingSample::fetch(const ParticleMap::Inherited& landmark) {
  for (std::size_t seat = 0; seat < jurors_.size(); ++seat) whose_[seat] = landmark.from[jurors_[seat]];
  landmark_.count_from(landmark.columns.origin());
  gather_landmark(landmark.columns, whose_, {0, kSeats}, landmark_);
}

void GatingSample::judge(const ReadingTerms& reading, const ParticleMap::Inherited& landmark) {
  fetch(landmark);
  set_surprises({reading, &landmark_}, sensors_, sensor_covariance_, {0, kSeats}, surprises_);
}

GatingSample::Verdict GatingSample::on(const ReadingTerms& reading, const ParticleMap::Inherited& landmark,
                                       double gate) {
  judge(reading, landmark);
  double against = 0.0;
  double all = 0.0;
  for (std::size_t seat = 1; seat < jurors_.size(); ++seat) {
    all += votes_[seat];
    if (surprises_[2][seat] > gate) against += votes_[seat];
  }
  return {against > 0.5 * all, {surprises_[0][0], surprises_[1][0]}, surprises_[2][0]};
}

void GatingSample::add_to(Whereabouts& where, const LandmarkEstimate& m) const {
  const Vector2 place(m.x, m.y);
  if (!where.is_somewhere) where.place = place;
  where.is_somewhere = true;
  where.reach_m = std::max(where.reach_m, (place - where.place).norm());
  where.sigma_m = std::max(where.sigma_m, std::sqrt(m.xx + m.yy));
}

GatingSample::Whereabouts GatingSample::where_is(const ParticleMap::Inherited& landmark) {
  fetch(landmark);
  Whereabouts where;
  for (std::size_t seat = 0; seat < jurors_.size(); ++seat)
    if (const LandmarkEstimate m = landmark_.at(seat); is_there(m)) add_to(where, m);
  return where;
}

GatingSample::Whereabouts GatingSample::where_points(const ReadingTerms& reading) const {
  Whereabouts where;
  for (std::size_t seat = 0; seat < jurors_.size(); ++seat) {
    const SensorAt sensor{sensors_.origin.x() + sensors_.x[seat], sensors_.origin.y() + sensors_.y[seat],
                          sensors_.cos[seat], sensors_.sin[seat]};
    add_to(where, first_estimate(sensor, reading));
  }
  const Matrix3& C = sensor_covariance_;
  const double by_sensor = C(0, 0) + C(1, 1) + reading.range * reading.range * C(2, 2);
  where.sigma_m = std::sqrt(where.sigma_m * where.sigma_m + by_sensor);
  return where;
}

double GatingSample::least_nis(const ReadingTerms& reading, const ParticleMap::Inherited& landmark) {
  judge(reading, landmark);
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t seat = 0; seat < jurors_.size(); ++seat)
    if (is_there(landmark_.at(seat))) least = std::min(least, surprises_[2][seat]);
  return least;
}

}  // namespace trundle
