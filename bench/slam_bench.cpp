// Landmark filters on one workload: a robot on a circle of radius M/4 m, M landmarks uniform in the annulus
// ±10 m around its path but not within 1 m of it, seen up to 10 m (about ten at a time), known ids, maps
// filled with all landmarks before the clock starts. Prints the time of a step and of a particle·sighting,
// and the error of the online position.
#include <algorithm>
#include <chrono>

#include <fmt/format.h>

#include "trundle/slam/slam.hpp"

namespace {

using namespace trundle;

constexpr double kSensorRange_m = 10.0;
constexpr double kClearance_m = 1.0;
constexpr int kSteps = 2000;

struct Workload {
  LandmarkSensor sensor{{}, 0.1, radians(1.0), kSensorRange_m, 0.0};
  std::vector<Vector2> landmarks;
  std::vector<SlamStep> steps;
  std::vector<Pose2> truth;
  std::vector<Observation> all;  ///< every landmark as seen from the start, to fill a map with
  std::size_t sightings = 0;
};

Observation seen(const Workload& work, const Pose2& pose, std::size_t landmark, Random& random) {
  const ExpectedReading exact = expected_reading(pose, {}, work.landmarks[landmark]);
  return {static_cast<LandmarkId>(landmark), exact.range_m + random.normal(work.sensor.range_sigma_m),
          exact.bearing_rad + random.normal(work.sensor.bearing_sigma_rad)};
}

void place_landmarks(Workload& work, int count, double radius, Random& random) {
  while (static_cast<int>(work.landmarks.size()) < count) {
    const double outer = radius + kSensorRange_m;
    const Vector2 place(random.uniform(-outer, outer), random.uniform(-outer, outer));
    const double off_path = std::abs(place.norm() - radius);
    if (off_path <= kSensorRange_m && off_path >= kClearance_m)
      work.landmarks.emplace_back(place.x(), place.y() + radius);
  }
}

void drive(Workload& work, double radius, int steps_per_loop, Random& random) {
  const double length = 2.0 * kPi * radius / steps_per_loop;
  const Twist2 twist{length, 0.0, 2.0 * kPi / steps_per_loop};
  const double sigma_m = 0.05 * length;
  const double sigma_rad = radians(0.2);
  Matrix3 covariance = Vector3(sigma_m * sigma_m, 1e-12, sigma_rad * sigma_rad).asDiagonal();
  Pose2 pose;
  for (int k = 0; k < kSteps; ++k) {
    const Twist2 error{random.normal(sigma_m), 0.0, random.normal(sigma_rad)};
    pose = pose * exp(twist);  // exactly on the circle: the odometry errs, and not the robot
    SlamStep step{static_cast<double>(k), {exp(twist) * exp(error), covariance, Matrix3::Zero()}, {}};
    for (std::size_t i = 0; i < work.landmarks.size(); ++i)
      if ((work.landmarks[i] - pose.translation()).norm() <= kSensorRange_m)
        step.observations.push_back(seen(work, pose, i, random));
    work.sightings += step.observations.size();
    work.truth.push_back(pose);
    work.steps.push_back(std::move(step));
  }
}

Workload workload(int landmarks, std::uint64_t seed) {
  Random random(seed, 1);
  Workload work;
  const double radius = landmarks / 4.0;
  place_landmarks(work, landmarks, radius, random);
  for (std::size_t i = 0; i < work.landmarks.size(); ++i) work.all.push_back(seen(work, {}, i, random));
  drive(work, radius, landmarks >= 10'000 ? 10'000 : 1000, random);
  return work;
}

struct Outcome {
  double step_us = 0.0;
  double longest_ms = 0.0;
  double error_m = 0.0;
};

Outcome run(const Workload& work, const SlamOptions& options, bool filled) {
  using Clock = std::chrono::steady_clock;
  SlamFilter filter(work.sensor, options);
  if (filled) filter.step({}, work.all);
  double squares = 0.0;
  std::chrono::duration<double> all{0.0};
  std::chrono::duration<double> longest{0.0};
  for (std::size_t k = 0; k < work.steps.size(); ++k) {
    const auto start = Clock::now();
    filter.step(work.steps[k].motion, work.steps[k].observations);
    const std::chrono::duration<double> taken = Clock::now() - start;
    all += taken;
    longest = std::max(longest, taken);
    squares += (filter.estimate().pose.translation() - work.truth[k].translation()).squaredNorm();
  }
  const auto steps = static_cast<double>(work.steps.size());
  return {1e6 * all.count() / steps, 1e3 * longest.count(), std::sqrt(squares / steps)};
}

void time_of(SlamMethod method, int landmarks, std::size_t particles) {
  const Workload work = workload(landmarks, 1);
  const Outcome outcome = run(work, {.method = method, .particles = particles, .keep_paths = false}, true);
  const double per_step = static_cast<double>(work.sightings) / kSteps;
  const double users = method == SlamMethod::ekf ? 1.0 : static_cast<double>(particles);
  fmt::print("{:<16} {:>7} {:>6} {:>7.1f} {:>10.1f} {:>10.2f} {:>12.1f}\n", name_of(method), landmarks,
             method == SlamMethod::ekf ? 0 : particles, per_step, outcome.step_us, outcome.longest_ms,
             1e3 * outcome.step_us / (per_step * users));
}

void error_of(SlamMethod method, std::size_t particles, int seeds) {
  std::vector<double> errors;
  for (int seed = 1; seed <= seeds; ++seed) {
    const auto s = static_cast<std::uint64_t>(seed);
    errors.push_back(run(workload(100, s),
                         {.method = method, .particles = particles, .seed = s, .keep_paths = false}, false)
                         .error_m);
  }
  std::ranges::sort(errors);
  fmt::print("{:<16} {:>6} {:>8} {:>10.3f}\n", name_of(method), particles, seeds, errors[errors.size() / 2]);
}

}  // namespace

int main(int argc, char** argv) {
  const int seeds = argc > 1 ? std::atoi(argv[1]) : 5;
  constexpr std::array kAll = {SlamMethod::fastslam1, SlamMethod::fastslam2, SlamMethod::mapso,
                               SlamMethod::mapso_proposal, SlamMethod::ekf};
  fmt::print("{:<16} {:>7} {:>6} {:>7} {:>10} {:>10} {:>12}\n", "filter", "M", "N", "in view", "us/step",
             "longest ms", "ns/(N view)");
  for (const int landmarks : {100, 1000, 10'000}) time_of(SlamMethod::fastslam1, landmarks, 1000);
  for (const SlamMethod method : kAll)
    if (method != SlamMethod::fastslam1) time_of(method, 100, method == SlamMethod::fastslam2 ? 1000 : 30);
  time_of(SlamMethod::ekf, 1000, 0);
  time_of(SlamMethod::fastslam1, 100, 300);
  fmt::print("\n{:<16} {:>6} {:>8} {:>10}   online position, rms [m], median, M = 100\n", "filter", "N",
             "seeds", "error");
  for (const SlamMethod method : kAll) error_of(method, 100, seeds);
  return 0;
}
