// How exact the landmark filters and the smoother are on workload W1 (w1.hpp), medians over seeds of the
// position error, rms over the run [m]: from the known start, and SE(2)-aligned, which takes away what the
// start's unknown heading does to a map 50 m away. The map empty at the start, and filled with all landmarks
// as seen from the start, as slam_bench fills it for timing. Beside ours the textbook's FastSLAM 1
// (textbook_fastslam.hpp) on the same steps, and what no estimator can be better than: the error that the
// smoother's covariances expect.
//   w1_errors_bench [seeds, default 3] [landmarks, default both 100 and 1000]
#include <algorithm>
#include <chrono>
#include <functional>
#include <map>

#include <fmt/format.h>

#include "trundle/evaluation/evaluate.hpp"
#include "trundle/slam/smoothing/smoother.hpp"

#include "textbook_fastslam.hpp"
#include "w1.hpp"

namespace {

using namespace trundle::pipeline;
namespace bench = trundle::bench;

double median_of(std::vector<double> x) {
  std::ranges::nth_element(x, x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2));
  return x[x.size() / 2];
}

double rms(const Trajectory& estimate, const Trajectory& truth, Alignment alignment) {
  return evaluate(estimate, truth, {.alignment = alignment, .distances_m = {}}).position_m.rms;
}

/// A workload as filters are given it; poses of the first step, which only fills the map, do not count.
struct Given {
  bench::W1 work;
  SlamInput input;
  Trajectory truth;
  bool filled = false;

  Given(const bench::W1Options& options, bool filled_map) : work(bench::w1(options)), filled(filled_map) {
    if (filled) input.steps.push_back({-1.0, {}, work.all});
    input.steps.insert(input.steps.end(), work.steps.begin(), work.steps.end());
    for (std::size_t k = 0; k < work.truth.size(); ++k)
      truth.poses.push_back({work.steps[k].time_s, work.truth[k]});
  }
  /// Without the step that fills the map, and without covariances.
  Trajectory counted(const Trajectory& trajectory) const {
    Trajectory result;
    result.poses.assign(trajectory.poses.begin() + (filled ? 1 : 0), trajectory.poses.end());
    return result;
  }
};

/// The figures of one row, by seed.
struct Row {
  std::vector<double> known_start;
  std::vector<double> aligned;

  void add(const Trajectory& estimate, const Trajectory& truth) {
    known_start.push_back(rms(estimate, truth, Alignment::none));
    aligned.push_back(rms(estimate, truth, Alignment::se2));
  }
};

Trajectory textbook(const Given& given, std::size_t particles) {
  const bench::W1& work = given.work;
  bench::TextbookFastSlam filter(
      particles, work.landmarks.size(),
      {work.sigma_m, work.sigma_rad, work.sensor.range_sigma_m, work.sensor.bearing_sigma_rad});
  Trajectory online;
  for (const SlamStep& step : given.input.steps) {
    filter.step(step.motion.mean, step.observations);
    const Vector2 position = filter.mean();
    online.poses.push_back({step.time_s, {position.x(), position.y(), 0.0}});
  }
  return online;
}

/// What is known of the smoother beside its errors.
struct Smoothing {
  std::vector<double> expected;  ///< error, by its covariances
  std::vector<double> excess;    ///< cost over that from the truth, less 1
  std::vector<double> over_freedom;
  std::vector<double> iterations;
  std::vector<double> ms;
};

double expected_rms(const Trajectory& trajectory) {
  double sum = 0.0;
  for (const Matrix3& P : trajectory.covariances) sum += P.topLeftCorner<2, 2>().trace();
  return std::sqrt(sum / static_cast<double>(trajectory.covariances.size()));
}

Trajectory smoothed(const Given& given, SlamResult filtered, Smoothing& smoothing) {
  const SmootherOptions options{.prior = {}};
  const auto start = std::chrono::steady_clock::now();
  SmoothedSlam result = smooth(given.input, given.work.sensor, filtered, options);
  smoothing.ms.push_back(1e3 *
                         std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  filtered.path = filtered.online;
  for (std::size_t k = 0; k < given.truth.poses.size(); ++k)
    filtered.path->poses[k + (given.filled ? 1 : 0)].pose = given.truth.poses[k].pose;
  const SmootherCounts truth = smooth(given.input, given.work.sensor, filtered, options).counts;
  smoothing.expected.push_back(expected_rms(result.trajectory));
  smoothing.excess.push_back(result.counts.cost / truth.cost - 1.0);
  smoothing.over_freedom.push_back(result.counts.cost / result.counts.degrees_of_freedom);
  smoothing.iterations.push_back(result.counts.iterations);
  return std::move(result.trajectory);
}

struct Contender {
  SlamMethod method;
  std::size_t particles;
};

void table(int landmarks, int seeds, bool filled) {
  std::vector<Contender> contenders = {{SlamMethod::ekf, 100},        {SlamMethod::smoother, 100},
                                       {SlamMethod::fastslam1, 100},  {SlamMethod::fastslam2, 100},
                                       {SlamMethod::mapso, 100},      {SlamMethod::mapso_proposal, 100},
                                       {SlamMethod::fastslam1, 1000}, {SlamMethod::fastslam2, 1000}};
  std::vector<std::string> names;
  std::vector<Row> rows(contenders.size() + 2);
  Smoothing smoothing;
  for (int seed = 1; seed <= seeds; ++seed) {
    const auto s = static_cast<std::uint64_t>(seed);
    const Given given({.landmarks = landmarks, .seed = s}, filled);
    for (std::size_t i = 0; i < contenders.size(); ++i) {
      const auto& [method, particles] = contenders[i];
      SlamResult result =
          slam(given.input, given.work.sensor, {.method = method, .particles = particles, .seed = s});
      rows[i].add(given.counted(result.online), given.truth);
      if (method == SlamMethod::fastslam2 && particles == 100)
        rows.back().add(given.counted(smoothed(given, std::move(result), smoothing)), given.truth);
    }
    rows[contenders.size()].add(given.counted(textbook(given, 1000)), given.truth);
  }
  for (const auto& [method, particles] : contenders)
    names.push_back(has_particles(method) ? fmt::format("{}, N = {}", name_of(method), particles)
                                          : fmt::format("{}, online", name_of(method)));
  names.emplace_back("textbook FastSLAM 1, N = 1000");
  names.emplace_back("smoother, afterwards, from fastslam2, N = 100");
  fmt::print("\nM = {}, map {} at the start, {} seeds\n\n| | known start | aligned |\n|---|---|---|\n",
             landmarks, filled ? "filled" : "empty", seeds);
  for (std::size_t i = 0; i < rows.size(); ++i)
    fmt::print("| {} | {:.3f} | {:.3f} |\n", names[i], median_of(rows[i].known_start),
               median_of(rows[i].aligned));
  fmt::print(
      "\nsmoother: its covariances expect {:.3f} m rms; cost at most {:.1e} above that from the truth, "
      "{:.3f} times the "
      "degrees of freedom; {:.0f} iterations, {:.0f} ms\n",
      median_of(smoothing.expected), std::ranges::max(smoothing.excess), median_of(smoothing.over_freedom),
      median_of(smoothing.iterations), median_of(smoothing.ms));
}

}  // namespace

int main(int argc, char** argv) {
  const int seeds = argc > 1 ? std::atoi(argv[1]) : 3;
  for (const int landmarks : {100, 1000})
    if (argc <= 2 || std::atoi(argv[2]) == landmarks)
      for (const bool filled : {false, true}) table(landmarks, seeds, filled);
}
