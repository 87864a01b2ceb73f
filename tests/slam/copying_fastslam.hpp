#pragma once

#include <map>

#include "trundle/simd/scalar.hpp"
#include "trundle/slam/fastslam/particle_slam.hpp"
#include "trundle/slam/steps.hpp"

namespace trundle::test {
using namespace slam;

/// FastSLAM 1.0 as it is usually written: each particle owns its map and its path, and resampling copies
/// both. Poses are drawn when something is seen. It shares the arithmetic of one landmark and the random
/// numbers with ParticleSlam, and nothing of how it stores anything: every particle is alone in its columns.
struct CopyingFastSlam {
  struct Particle {
    PoseColumns pose{1};
    double log_weight = 0.0;
    std::map<LandmarkId, LandmarkColumns> map;
    std::vector<Pose2> path;
  };
  static constexpr ParticleRange kOne{0, kParticleLanes};

  LandmarkSensor sensor;
  std::uint64_t seed;
  std::vector<Particle> particles;
  Random random;
  Motion pending;
  std::uint64_t draws = 1;  ///< the start is certain: drawn all the same
  std::size_t resamplings = 0;

  CopyingFastSlam(const LandmarkSensor& s, std::size_t count, std::uint64_t number)
      : sensor(s), seed(number), particles(count), random(number, kResamplingStream) {}

  void step(const SlamStep& step) {
    pending = pending * step.motion;
    if (step.observations.empty()) return;
    const Matrix3 L = pending.covariance.llt().matrixL();
    TripleColumns n(particles.size());
    draw_normals({seed, draws, 0}, {0, padded(particles.size())}, n);
    draws += 2;  // the second is for what this filter has not
    Vector2 origin;
    for (std::size_t i = 0; i < particles.size(); ++i) {
      Particle& p = particles[i];
      PoseColumns predicted(1);
      predict(p.pose, SystematicColumns(1, 0), {pending.mean}, kOne, predicted);
      if (i == 0) origin = predicted.at(0).translation();
      TripleColumns own(1);
      own.set(0, n.at(i));
      SensorColumns at(1);
      at.origin = origin;
      place(predicted, own, {L, sensor.body_from_sensor}, kOne, p.pose, at);
      look(p, at, step.observations);
      p.path.push_back(p.pose.at(0));
    }
    pending = {};
    weigh_and_resample();
  }

 private:
  void look(Particle& p, const SensorColumns& at, const std::vector<Observation>& observations) {
    std::vector<KnownReading> known;
    std::vector<const Observation*> unmapped;
    for (const Observation& observation : observations) {
      const auto mapped = p.map.find(observation.landmark);
      if (mapped == p.map.end())
        unmapped.push_back(&observation);
      else
        known.push_back({reading_terms(observation, sensor), &mapped->second});
    }
    Column<double> sum(kParticleLanes, p.log_weight);
    weigh_and_improve({known, at.origin}, at, kOne, sum.data());
    p.log_weight = sum[0];
    for (const Observation* observation : unmapped) {
      const ReadingTerms reading = reading_terms(*observation, sensor);
      const LandmarkEstimate of_first =
          first_estimate(sensor_at(particles[0].pose.at(0), sensor.body_from_sensor), reading);
      const auto [mapped, is_new] =
          p.map.try_emplace(observation->landmark, 1, Vector2(of_first.x, of_first.y));
      set_first_estimates(reading, at, kOne, mapped->second);
    }
  }

  void weigh_and_resample() {
    double largest = particles[0].log_weight;
    for (const Particle& p : particles) largest = std::max(largest, p.log_weight);
    double sum = 0.0;
    std::vector<double> weight;
    for (Particle& p : particles) {
      p.log_weight -= largest;
      weight.push_back(scalar::exp(p.log_weight));
      sum += weight.back();
    }
    double squares = 0.0;
    for (double& w : weight) {
      w /= sum;
      squares += w * w;
    }
    const auto count = particles.size();
    if (1.0 / squares >= 0.5 * static_cast<double>(count)) return;
    ++resamplings;
    const double offset = random.uniform();
    std::vector<Particle> children;
    double reached = weight[0];
    std::size_t parent = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const double point = (static_cast<double>(i) + offset) / static_cast<double>(count);
      while (reached < point && parent + 1 < count) reached += weight[++parent];
      children.push_back(particles[parent]);
      children.back().log_weight = 0.0;
    }
    particles = std::move(children);
  }
};

}  // namespace trundle::test
