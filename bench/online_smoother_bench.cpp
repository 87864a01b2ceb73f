// The smoother as it drives, on workload W1 (w1.hpp), map empty at the start, one thread: position error of
// each pose as it was known at its time [m, rms], mean NEES (3 if consistent), processor time of a step, and,
// every hundredth step, how far it is from the batch over everything so far.
//   online_smoother_bench [seeds, default 3] [landmarks, default both 100 and 1000] [steps, default 2000]
// Or with a window, for a long drive: the same, with the time of a step and the memory of the process after
// each 10 000 steps, and nothing compared.
//   online_smoother_bench window [window, default 60 s] [landmarks, default 1000] [steps, default 100 000]
//     [seed, default 1]
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <string_view>

#include <Eigen/Cholesky>
#include <fmt/format.h>
#include <unistd.h>

#include "trundle/io/archive.hpp"
#include "trundle/slam/smoothing/incremental_smoother.hpp"
#include "trundle/slam/smoothing/solver/minimise.hpp"

#include "w1.hpp"

namespace {

using namespace trundle::slam;
namespace bench = trundle::bench;

constexpr int kCompareEvery = 100;

double processor_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

Vector3 error_of(const Pose2& estimate, const Pose2& truth) {
  return {estimate.x - truth.x, estimate.y - truth.y, wrap_angle(estimate.heading - truth.heading)};
}

double nees(const Vector3& error, const Matrix3& covariance) {
  return error.dot(covariance.ldlt().solve(error));
}

/// Sums over the steps of a run.
struct Run {
  double squared_m = 0.0;
  double nees = 0.0;
  double compared_squared_m = 0.0;  ///< of the steps that are compared
  double batch_squared_m = 0.0;     ///< of the batch there
  double furthest = 0.0;            ///< from the batch [sigmas]
  std::vector<double> seconds;
};

void compare(const IncrementalSmoother& smoother, const PoseEstimate& online, const Pose2& truth, Run& run) {
  Minimiser batch(smoother.problem());
  const Minimum minimum = batch.minimise(smoother.problem(), smoother.state(), {.enough = 1e-9});
  const Pose2& pose = minimum.state.poses.back();
  run.compared_squared_m += error_of(online.pose, truth).head<2>().squaredNorm();
  run.batch_squared_m += error_of(pose, truth).head<2>().squaredNorm();
  run.furthest = std::max(run.furthest, std::sqrt(nees(error_of(online.pose, pose), online.covariance)));
}

Run run_of(const bench::W1& work) {
  Run run;
  IncrementalSmoother smoother(work.sensor, {});
  for (std::size_t k = 0; k < work.steps.size(); ++k) {
    const double before = processor_s();
    smoother.step(work.steps[k].motion, work.steps[k].observations);
    const PoseEstimate estimate = smoother.estimate();
    run.seconds.push_back(processor_s() - before);
    const Vector3 error = error_of(estimate.pose, work.truth[k]);
    run.squared_m += error.head<2>().squaredNorm();
    if (k > 0) run.nees += nees(error, estimate.covariance);
    if (k % kCompareEvery == kCompareEvery - 1) compare(smoother, estimate, work.truth[k], run);
  }
  return run;
}

/// Of the process, resident.
double memory_mb() {
  long pages = 0;
  std::ifstream("/proc/self/statm") >> pages >> pages;
  return static_cast<double>(pages) * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

void long_drive(double window_s, int landmarks, int steps, std::uint64_t seed) {
  const int piece = std::max(1, std::min(steps, 10'000));
  fmt::print(
      "\nM = {}, window of {} s, seed {}\n\n| steps | rms | NEES | step: mean, median, 99 %, longest [ms] | "
      "memory: process, state [MB] |\n|---|---|---|---|---|\n",
      landmarks, window_s, seed);
  const bench::W1 work = bench::w1({.landmarks = landmarks, .steps = steps, .seed = seed});
  const double before_mb = memory_mb();
  IncrementalSmoother smoother(work.sensor, {.window_s = window_s});
  Run run;
  for (std::size_t k = 0; k < work.steps.size(); ++k) {
    const double before = processor_s();
    smoother.step(work.steps[k].motion, work.steps[k].observations, work.steps[k].time_s);
    const PoseEstimate estimate = smoother.estimate();
    run.seconds.push_back(processor_s() - before);
    const Vector3 error = error_of(estimate.pose, work.truth[k]);
    run.squared_m += error.head<2>().squaredNorm();
    if (k > 0) run.nees += nees(error, estimate.covariance);
    if (static_cast<int>(run.seconds.size()) < piece) continue;
    double total_s = 0.0;
    for (const double s : run.seconds) total_s += s;
    std::ranges::sort(run.seconds);
    const std::size_t last = run.seconds.size() - 1;
    fmt::print("| {} | {:.3f} | {:.2f} | {:.3f}, {:.3f}, {:.2f}, {:.1f} | {:.1f}, {:.1f} |\n", k + 1,
               std::sqrt(run.squared_m / piece), run.nees / piece, 1e3 * total_s / piece,
               1e3 * run.seconds[last / 2], 1e3 * run.seconds[last * 99 / 100], 1e3 * run.seconds[last],
               memory_mb() - before_mb, 1e-6 * static_cast<double>(trundle::io::state_of(smoother).size()));
    std::fflush(stdout);
    run = {};
  }
}

void table(int landmarks, int seeds, int steps) {
  fmt::print(
      "\nM = {}, {} steps\n\n| seed | rms | NEES | rms over that of the batch | furthest from it [sigma] | "
      "step: "
      "mean, median, 99 %, longest [ms] |\n|---|---|---|---|---|---|\n",
      landmarks, steps);
  std::vector<double> rms;
  for (int seed = 1; seed <= seeds; ++seed) {
    Run run =
        run_of(bench::w1({.landmarks = landmarks, .steps = steps, .seed = static_cast<std::uint64_t>(seed)}));
    double total_s = 0.0;
    for (const double s : run.seconds) total_s += s;
    std::ranges::sort(run.seconds);
    const std::size_t last = run.seconds.size() - 1;
    rms.push_back(std::sqrt(run.squared_m / steps));
    fmt::print("| {} | {:.3f} | {:.2f} | {:.3f} | {:.2f} | {:.3f}, {:.3f}, {:.2f}, {:.1f} |\n", seed,
               rms.back(), run.nees / (steps - 1), std::sqrt(run.compared_squared_m / run.batch_squared_m),
               run.furthest, 1e3 * total_s / steps, 1e3 * run.seconds[last / 2],
               1e3 * run.seconds[last * 99 / 100], 1e3 * run.seconds[last]);
  }
  std::ranges::sort(rms);
  fmt::print("\nmedian rms {:.3f} m\n", rms[rms.size() / 2]);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 1 && std::string_view(argv[1]) == "window") {
    const auto given = [&](int i, int usual) { return argc > i ? std::atoi(argv[i]) : usual; };
    long_drive(given(2, 60), given(3, 1000), given(4, 100'000), static_cast<std::uint64_t>(given(5, 1)));
    return 0;
  }
  const int seeds = argc > 1 ? std::atoi(argv[1]) : 3;
  const int steps = argc > 3 ? std::atoi(argv[3]) : 2000;
  for (const int landmarks : {100, 1000})
    if (argc <= 2 || std::atoi(argv[2]) == landmarks) table(landmarks, seeds, steps);
}
