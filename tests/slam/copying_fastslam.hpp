#pragma once

#include <map>

#include "trundle/slam/particle_slam.hpp"
#include "trundle/slam/steps.hpp"

namespace trundle::test {

/// FastSLAM 1.0 as it is usually written: each particle owns its map and its path, and resampling copies
/// both. Poses are drawn when something is seen. It shares the arithmetic of one landmark, the random numbers
/// and their order with ParticleSlam, and nothing of how it stores anything.
struct CopyingFastSlam {
  struct Particle {
    Pose2 pose;
    double log_weight = 0.0;
    std::map<LandmarkId, LandmarkEstimate> map;
    std::vector<Pose2> path;
  };

  LandmarkSensor sensor;
  std::vector<Particle> particles;
  std::vector<Random> random;
  Motion pending;
  std::size_t resamplings = 0;

  CopyingFastSlam(const LandmarkSensor& s, std::size_t count, std::uint64_t seed)
      : sensor(s), particles(count) {
    for (std::size_t block = 0; block <= (count + kParticleBlock - 1) / kParticleBlock; ++block)
      random.emplace_back(seed, block);
    for (std::size_t i = 0; i < count; ++i) draw(i);  // the start is certain: drawn all the same
  }

  Vector3 draw(std::size_t i) {
    Random& r = random[i / kParticleBlock];
    const double x = r.normal();
    const double y = r.normal();
    return {x, y, r.normal()};
  }

  void step(const SlamStep& step) {
    pending = pending * step.motion;
    if (step.observations.empty()) return;
    const Matrix3 L = pending.covariance.llt().matrixL();
    for (std::size_t i = 0; i < particles.size(); ++i) {
      Particle& p = particles[i];
      p.pose = p.pose * pending.mean * exp(Twist2::from(L * draw(i)));
      const SensorAt at = sensor_at(p.pose, sensor.body_from_sensor);
      for (const bool known : {true, false})
        for (const Observation& observation : step.observations) look(p, at, observation, known);
      p.path.push_back(p.pose);
    }
    pending = {};
    weigh_and_resample();
  }

 private:
  void look(Particle& p, const SensorAt& at, const Observation& observation, bool known) const {
    const bool mapped = p.map.contains(observation.landmark);
    if (known != mapped) return;
    const ReadingTerms reading = reading_terms(observation, sensor);
    if (!mapped) {
      p.map[observation.landmark] = first_estimate(at, reading);
      return;
    }
    LandmarkEstimate& m = p.map.at(observation.landmark);
    const Sight sight = sight_of(at, reading, m);
    p.log_weight += log_likelihood_of(sight);
    improve(m, sight);
  }

  void weigh_and_resample() {
    double largest = particles[0].log_weight;
    for (const Particle& p : particles) largest = std::max(largest, p.log_weight);
    double sum = 0.0;
    std::vector<double> weight;
    for (Particle& p : particles) {
      p.log_weight -= largest;
      weight.push_back(std::exp(p.log_weight));
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
    const double offset = random.back().uniform();
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
