// The law of every proposal: whatever is drawn from, the mean of weight · likelihood is that of the
// likelihood over the motion. docs/theory/fastslam.md, eq. 16.
#include "trundle/slam/fastslam/proposal.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "trundle/slam/cholesky.hpp"

namespace trundle::slam {
namespace proposal_test {

constexpr std::size_t kDraws = 1 << 16;

struct Mean {
  double value = 0.0;
  double sigma = 0.0;  ///< 1σ of it
};

/// Of weight · likelihood over the draws of one step in which one landmark is seen. The motion is known so
/// poorly that neither a linearised Gaussian nor one at the optimum fits.
Mean mean_of_draws(Proposal kind) {
  const LandmarkSensor sensor{{0.1, 0.05, 0.2}, 0.3, 0.1, 20.0, 0.0};
  LandmarkColumns landmark(kDraws);
  for (std::size_t i = 0; i < kDraws; ++i) landmark.set(i, {2.0, 0.5, 0.01, 0.0, 0.01});
  const KnownReading reading{reading_terms({0, 2.2, 0.1}, sensor), &landmark};
  ParticleSet particles(kDraws, 0);
  const NearReadings near({&reading, 1}, particles.sensors.origin);
  const PoseProposal::Step step{
      near,
      {semidefinite_root(Vector3(0.04, 0.04, 0.3).asDiagonal()), sensor.body_from_sensor},
      {.seed = 3, .step = 2}};
  draw_normals({.seed = 3, .step = 1}, particles.all(), particles.noise);
  PoseProposal proposal(kind, {}, kDraws);
  ThreadPool alone(1, kDraws);
  const Matrix3 L = proposal.is_motion() ? step.by_motion.L : Matrix3(Matrix3::Zero());
  place(particles.predicted, particles.noise, {L, sensor.body_from_sensor}, particles.all(), particles.poses,
        particles.sensors);
  proposal.refine(step, alone, particles);
  proposal.draw(step, particles.all(), particles);
  weigh_and_improve(near, particles.sensors, particles.all(), particles.log_weights.data());
  double sum = 0.0, squares = 0.0;
  for (std::size_t i = 0; i < kDraws; ++i) {
    const double weight = std::exp(particles.log_weights[i]);
    sum += weight;
    squares += weight * weight;
  }
  constexpr double kCount = kDraws;
  const double mean = sum / kCount;
  return {mean, std::sqrt((squares / kCount - mean * mean) / kCount)};
}

TEST(Proposals, WhateverIsDrawnFromTheMeanOfWeightTimesLikelihoodIsTheSame) {
  const Mean motion = mean_of_draws(Proposal::motion);
  for (const Proposal kind : {Proposal::linearised, Proposal::swarm_gaussian}) {
    const Mean mean = mean_of_draws(kind);
    EXPECT_NEAR(mean.value, motion.value, 4.0 * std::hypot(mean.sigma, motion.sigma));
    EXPECT_LT(mean.sigma, motion.sigma);  // what it is drawn for
  }
}

// As published: its weights know nothing of how it moved the particles.
TEST(Proposals, OfTheSwarmAsPublishedTheMeanIsAnother) {
  const Mean motion = mean_of_draws(Proposal::motion);
  EXPECT_GT(mean_of_draws(Proposal::swarm).value, 1.2 * motion.value);
}

}  // namespace proposal_test
}  // namespace trundle::slam
