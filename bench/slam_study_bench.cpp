// What particles buy, and what they cost in honesty: workload W1 (w1.hpp), two loops from a known start, in a
// room (20 landmarks, loops of 31 m, half the room in view) and around a block (100 landmarks, loops of 157
// m, a tenth in view). As markdown, for docs/results/particles.md.
//   slam_study_bench [seeds, default 3] [landmarks, default both 20 and 100]
#include <algorithm>
#include <cstdio>
#include <string_view>

#include <Eigen/Cholesky>
#include <fmt/format.h>

#include "trundle/evaluation/evaluate.hpp"
#include "trundle/slam/fastslam/particle_slam.hpp"
#include "trundle/slam/smoothing/smoother.hpp"
#include "trundle/statistics/distribution.hpp"

#include "w1.hpp"

namespace {

using namespace trundle::pipeline;
namespace bench = trundle::bench;

constexpr std::size_t kLoop = 1000;  // steps
constexpr std::size_t kBack = 100;   // steps over which the survival of ancestors is counted

/// log(estimate⁻¹ truth) in its covariance: 3 on average if honest.
double nees_of(const Pose2& estimate, const Matrix3& covariance, const Pose2& truth) {
  const Vector3 e = log(estimate.inverse() * truth).vector();
  return e.dot(body_covariance(estimate, covariance).ldlt().solve(e));
}

double mean_of(const std::vector<double>& x) {
  double sum = 0.0;
  for (const double value : x) sum += value;
  return x.empty() ? 0.0 : sum / static_cast<double>(x.size());
}

double quantile(std::vector<double> x, double share) {
  std::ranges::sort(x);
  return x[static_cast<std::size_t>(share * static_cast<double>(x.size() - 1))];
}

/// What is collected of one filter, over all seeds.
struct Figures {
  std::vector<double> rms_m;      ///< of the online position, one for each run
  std::vector<double> aligned_m;  ///< the same, SE(2)-aligned: without the turn of the whole map
  std::vector<double> loop_nees;  ///< mean over the first loop, one for each run
  std::vector<double> nis;        ///< of every matched or rejected sighting
  std::vector<double> effective;  ///< share of the particles, one for each step
  std::vector<double> ancestors;  ///< share of the particles kBack steps before that have descendants
};

/// Of one run, while it goes on.
class Watch {
 public:
  Watch(const bench::W1& work, Figures& figures) : work_(work), figures_(figures) {}
  ~Watch() {
    figures_.rms_m.push_back(rms(Alignment::none));
    figures_.aligned_m.push_back(rms(Alignment::se2));
    figures_.loop_nees.push_back(mean_of(nees_));
  }
  void see(const PoseEstimate& estimate, const StepReport& report) {
    const Pose2& truth = work_.truth[step_];
    const auto time_s = static_cast<double>(step_);
    online_.poses.push_back({time_s, estimate.pose});
    truth_.poses.push_back({time_s, truth});
    if (step_ < kLoop) nees_.push_back(nees_of(estimate.pose, estimate.covariance, truth));
    for (const ObservationReport& seen : report.observations)
      if (seen.nis > 0.0) figures_.nis.push_back(seen.nis);
    ++step_;
  }

 private:
  double rms(Alignment alignment) const {
    return evaluate(online_, truth_, {.alignment = alignment, .distances_m = {}}).position_m.rms;
  }

  const bench::W1& work_;
  Figures& figures_;
  std::size_t step_ = 0;
  Trajectory online_;
  Trajectory truth_;
  std::vector<double> nees_;
};

void run(const bench::W1& work, const ParticleSlamOptions& options, Figures& figures) {
  ParticleSlam filter(work.sensor, options);
  Watch watch(work, figures);
  const auto particles = static_cast<double>(options.particles);
  for (std::size_t k = 0; k < work.steps.size(); ++k) {
    const StepReport& report = filter.step(work.steps[k].motion, work.steps[k].observations);
    watch.see(filter.estimate(), report);
    figures.effective.push_back(report.effective_particles / particles);
    if (k >= kBack) figures.ancestors.push_back(static_cast<double>(filter.ancestors(kBack)) / particles);
  }
}

void run_ekf(const bench::W1& work, Figures& figures) {
  SlamFilter filter(work.sensor, {.method = SlamMethod::ekf});
  Watch watch(work, figures);
  for (const SlamStep& step : work.steps) {
    const StepReport report = filter.step(step.motion, step.observations);
    watch.see(filter.estimate(), report);
  }
}

/// The covariance of particles that have all become one is singular, and rounding gives it any sign.
std::string nees_text(double nees) {
  constexpr double kMost = 1000.0;
  return nees >= 0.0 && nees < kMost ? fmt::format("{:.1f}", nees) : "> 1000";
}

void print(const std::string& name, const Figures& figures) {
  fmt::print("| {} | {:.3f} | {:.3f} | {:.3f} | {} | {} | {:.2f} |", name, quantile(figures.rms_m, 0.5),
             quantile(figures.rms_m, 0.9), quantile(figures.aligned_m, 0.5),
             nees_text(quantile(figures.loop_nees, 0.5)), nees_text(mean_of(figures.loop_nees)),
             mean_of(figures.nis));
  if (figures.effective.empty())
    fmt::print(" | |\n");
  else
    fmt::print(" {:.0f} % | {:.1f} % |\n", 100.0 * mean_of(figures.effective),
               100.0 * mean_of(figures.ancestors));
  std::fflush(stdout);
}

struct Contender {
  const char* name;
  Proposal proposal;
  std::vector<std::size_t> particles;
};

struct World {
  const char* name;
  int landmarks;
  double odometry_noise;  ///< times that of W1
};

bench::W1 work_of(const World& world, int seed) {
  return bench::w1({.landmarks = world.landmarks,
                    .seed = static_cast<std::uint64_t>(seed),
                    .odometry_noise = world.odometry_noise});
}

void filters(const World& world, int seeds) {
  const std::vector<Contender> contenders = {
      {"fastslam1", Proposal::motion, {10, 20, 30, 50, 100, 200, 500, 1000}},
      {"fastslam2", Proposal::linearised, {10, 20, 30, 50, 100, 200, 500, 1000}},
      {"mapso", Proposal::swarm, {10, 20, 30, 50, 100, 200}},
      {"mapso_proposal", Proposal::swarm_gaussian, {10, 20, 30, 50, 100, 200}}};
  fmt::print(
      "| filter, particles | error, median [m] | 90 % of runs below [m] | aligned, median [m] | NEES of the "
      "first "
      "loop (3): median | mean | NIS (2) | N_eff | ancestors {} steps back "
      "|\n|---|---|---|---|---|---|---|---|---|\n",
      kBack);
  for (const Contender& contender : contenders)
    for (const std::size_t particles : contender.particles) {
      Figures figures;
      for (int seed = 1; seed <= seeds; ++seed)
        run(work_of(world, seed),
            {.proposal = contender.proposal,
             .particles = particles,
             .seed = static_cast<std::uint64_t>(seed)},
            figures);
      print(fmt::format("`{}` {}", contender.name, particles), figures);
    }
  Figures figures;
  for (int seed = 1; seed <= seeds; ++seed) run_ekf(work_of(world, seed), figures);
  print("`ekf`", figures);
}

/// NEES of the smoothed poses, step by step over all seeds, in the band that 99.9 % of honest sums keep to.
void smoother(const World& world, int seeds) {
  const std::vector<std::size_t> steps = {49, 249, 499, 749, 999, 1499, 1999};
  std::vector<double> nees(steps.size());
  for (int seed = 1; seed <= seeds; ++seed) {
    const bench::W1 work = work_of(world, seed);
    const SlamInput input{0.0, work.steps, {}, {}};
    const SmoothedSlam smoothed =
        smooth(input, work.sensor, slam(input, work.sensor, {.method = SlamMethod::ekf}), {.prior = {}});
    for (std::size_t i = 0; i < steps.size(); ++i)
      nees[i] += nees_of(smoothed.trajectory.poses[steps[i]].pose, smoothed.trajectory.covariances[steps[i]],
                         work.truth[steps[i]]);
  }
  const double freedom = 3.0 * seeds;
  fmt::print("\nSmoother, mean NEES over {} seeds (99.9 % of honest ones: {:.2f} to {:.2f}):\n\n|", seeds,
             chi_squared_limit(0.9995, freedom) / seeds, chi_squared_limit(0.0005, freedom) / seeds);
  for (const std::size_t step : steps) fmt::print(" step {} |", step + 1);
  fmt::print("\n|");
  for (std::size_t i = 0; i < steps.size(); ++i) fmt::print("---|");
  fmt::print("\n|");
  for (const double sum : nees) fmt::print(" {:.2f} |", sum / seeds);
  fmt::print("\n");
}

}  // namespace

int main(int argc, char** argv) {
  const int seeds = argc > 1 ? std::atoi(argv[1]) : 3;
  for (const World& world : {World{"room", 20, 1.0}, World{"poor", 20, 20.0}, World{"block", 100, 1.0}})
    if (argc <= 2 || std::string_view(argv[2]) == world.name) {
      fmt::print("\n{}: {} landmarks, odometry noise x {}, {} seeds\n\n", world.name, world.landmarks,
                 world.odometry_noise, seeds);
      filters(world, seeds);
      smoother(world, seeds);
    }
}
