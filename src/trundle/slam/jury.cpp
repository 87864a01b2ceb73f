#include "trundle/slam/jury.hpp"

#include "trundle/slam/particle_kernels.hpp"

namespace trundle {

Jury::Jury(std::size_t particles, Precision precision)
    : particles_(particles),
      predicted_(kSeats),
      sensors_(kSeats),
      landmark_(kSeats, precision),
      surprises_(kSeats) {
  jurors_.reserve(kSeats);
  votes_.reserve(kSeats);
}

void Jury::meet(const Case& at) {
  jurors_.assign(1, at.reporter);
  votes_.assign(1, 0.0);
  const std::size_t stride = (particles_ + kSeats - 2) / (kSeats - 1);
  for (std::size_t i = 0; i < particles_; i += stride) {
    jurors_.push_back(i);
    votes_.push_back(at.weights[i]);
  }
  for (std::size_t seat = 0; seat < jurors_.size(); ++seat)
    predicted_.set(seat, at.predicted.at(jurors_[seat]));
  sensors_.origin = at.predicted.at(0).translation();
  const TripleColumns still(kSeats);
  place(predicted_, still, {Matrix3::Zero(), at.body_from_sensor}, {0, kSeats}, predicted_, sensors_);
  const Matrix3 Ad = adjoint(at.body_from_sensor.inverse());
  sensor_covariance_ = Ad * at.predicted_covariance * Ad.transpose();
}

Jury::Verdict Jury::on(const KnownReading& known, double gate) {
  landmark_.take(*known.landmark, jurors_);
  set_surprises({known.reading, &landmark_}, sensors_, sensor_covariance_, {0, kSeats}, surprises_);
  double against = 0.0;
  double all = 0.0;
  for (std::size_t seat = 1; seat < jurors_.size(); ++seat) {
    all += votes_[seat];
    if (surprises_[2][seat] > gate) against += votes_[seat];
  }
  return {against > 0.5 * all, {surprises_[0][0], surprises_[1][0]}, surprises_[2][0]};
}

}  // namespace trundle
