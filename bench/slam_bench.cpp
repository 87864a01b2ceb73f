// Landmark filters on workload W1 (w1.hpp), each measured in slices that take turns with the textbook's
// FastSLAM 1 (textbook_fastslam.hpp), so that what else the machine does touches all of them alike: the ratio
// is the median over the slices. Maps are filled with all landmarks before the clock starts; the estimate is
// read outside the clock. Nothing is rejected as an outlier: the textbook has no gate, and what is rejected
// costs nothing. Prints markdown.
//   slam_bench [seeds of the error table, default 5; 0: none] ["wide": also N = 1000, M = 100 000: 5 GB]
#include <algorithm>
#include <chrono>
#include <fstream>
#include <functional>
#include <limits>
#include <numeric>

#include <fmt/format.h>
#include <malloc.h>

#include "trundle/slam/slam.hpp"

#include "textbook_fastslam.hpp"
#include "w1.hpp"

namespace {

using namespace trundle::pipeline;
namespace bench = trundle::bench;

constexpr int kSlices = 9;

double median_of(std::vector<double> x) {
  std::ranges::nth_element(x, x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2));
  return x[x.size() / 2];
}

/// The highest of the process since the last call [MiB]. What has been freed is given back.
double peak_memory_MiB() {
  double peak_kB = 0.0;
  malloc_trim(0);
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;)
    if (word == "VmHWM:") status >> peak_kB;
  std::ofstream("/proc/self/clear_refs") << 5;
  return peak_kB / 1024.0;
}

/// A filter in the race.
struct Contender {
  std::string name;
  std::size_t particles;
  std::function<bool(const SlamStep&)> step;  ///< true: it has resampled
  std::function<Vector2()> position;
  double memory_MiB = 0.0;
  int slice = 200;                         ///< steps that it takes at a time
  std::vector<double> slice_us = {};       ///< per step
  std::vector<double> step_us = {};        ///< of all steps
  std::vector<double> resampling_us = {};  ///< of those that resample
  double squares = 0.0;                    ///< of the position's error

  void run_slice(const bench::W1& work) {
    using Clock = std::chrono::steady_clock;
    double sum = 0.0;
    for (int i = 0; i < slice; ++i) {
      const std::size_t k = step_us.size();
      const SlamStep& given = work.steps[k];
      const auto start = Clock::now();
      const bool resampled = step(given);
      step_us.push_back(1e6 * std::chrono::duration<double>(Clock::now() - start).count());
      if (resampled) resampling_us.push_back(step_us.back());
      sum += step_us.back();
      squares += (position() - work.truth[k].translation()).squaredNorm();
    }
    slice_us.push_back(sum / slice);
  }
  double quantile(double share) const {
    std::vector<double> sorted = step_us;
    std::ranges::sort(sorted);
    return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
  }
  double mean() const {
    return std::accumulate(step_us.begin(), step_us.end(), 0.0) / static_cast<double>(step_us.size());
  }
  double rms() const { return std::sqrt(squares / static_cast<double>(step_us.size())); }
  /// Median over the slices of how many times faster it is than another, all particles together.
  double faster_than(const Contender& other) const {
    std::vector<double> ratios;
    for (std::size_t i = 0; i < slice_us.size(); ++i) ratios.push_back(other.slice_us[i] / slice_us[i]);
    return median_of(ratios);
  }
};

Contender textbook(const bench::W1& work, std::size_t particles) {
  peak_memory_MiB();
  const double before_MiB = peak_memory_MiB();
  const bench::TextbookFastSlam::Noise noise{work.sigma_m, work.sigma_rad, work.sensor.range_sigma_m,
                                             work.sensor.bearing_sigma_rad};
  auto filter = std::make_shared<bench::TextbookFastSlam>(particles, work.landmarks.size(), noise);
  filter->step({}, work.all);
  Contender contender{"textbook", particles,
                      [filter](const SlamStep& step) {
                        const auto resampled_before = filter->resamplings;
                        filter->step(step.motion.mean, step.observations);
                        return filter->resamplings > resampled_before;
                      },
                      [filter] { return filter->mean(); }};
  if (work.landmarks.size() >= 10'000) contender.slice = 20;
  contender.memory_MiB = peak_memory_MiB() - before_MiB;
  return contender;
}

Contender ours(const bench::W1& work, SlamMethod method, const SlamOptions& base, const std::string& remark) {
  peak_memory_MiB();
  const double before_MiB = peak_memory_MiB();
  SlamOptions options = base;
  options.method = method;
  options.keep_paths = false;
  options.gate = std::numeric_limits<double>::infinity();
  auto filter = std::make_shared<SlamFilter>(work.sensor, options);
  filter->step({}, work.all);
  Contender contender{
      std::string(name_of(method)) + remark, method == SlamMethod::ekf ? 1 : base.particles,
      [filter](const SlamStep& step) { return filter->step(step.motion, step.observations).resampled; },
      [filter] { return filter->estimate().pose.translation(); }};
  contender.memory_MiB = peak_memory_MiB() - before_MiB;
  return contender;
}

std::vector<Observation> hidden(std::vector<Observation> observations) {
  for (Observation& observation : observations) observation.landmark = kUnknownLandmark;
  return observations;
}

/// The same without names. Its map is filled by a lap without any error of the odometry, back to the start.
Contender unidentified(const bench::W1& work, SlamMethod method, const SlamOptions& base) {
  SlamOptions options = base;
  options.method = method;
  options.keep_paths = false;
  auto filter = std::make_shared<SlamFilter>(work.sensor, options);
  Pose2 before;
  for (std::size_t k = 0; k <= work.steps_per_lap; ++k) {
    filter->step(motion_of(log(before.inverse() * work.truth[k]), 1e-10 * Matrix3::Identity()),
                 hidden(work.steps[k].observations));
    before = work.truth[k];
  }
  return {std::string(name_of(method)) + " without names", base.particles,
          [filter](const SlamStep& step) {
            return filter->step(step.motion, hidden(step.observations)).resampled;
          },
          [filter] { return filter->estimate().pose.translation(); }};
}

void heading(const std::string& what) {
  fmt::print(
      "\n**{}**\n\n| filter | M | N | µs/step | mean | p50 | p99 | max | resampling | ns/(N v) | times as "
      "fast "
      "| MiB | rms [m] |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
      what);
}

void print(const bench::W1& work, const Contender& c, const Contender& yardstick) {
  const double step_us = median_of(c.slice_us);
  fmt::print(
      "| {} | {} | {} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.2f} | {:.0f} | "
      "{:.3f} |\n",
      c.name, work.landmarks.size(), c.particles, step_us, c.mean(), c.quantile(0.5), c.quantile(0.99),
      c.quantile(1.0), c.resampling_us.empty() ? 0.0 : median_of(c.resampling_us),
      1e3 * step_us / (work.in_view * static_cast<double>(c.particles)), c.faster_than(yardstick),
      c.memory_MiB, c.rms());
}

/// In turns; 'times as fast' as the first.
void race(const bench::W1& work, std::vector<Contender> contenders) {
  for (int slice = 0; slice < kSlices; ++slice)
    for (Contender& contender : contenders) contender.run_slice(work);
  for (const Contender& contender : contenders) print(work, contender, contenders.front());
}

void races() {
  const SlamOptions thousand{.particles = 1000};
  SlamOptions by_two = thousand;
  by_two.threads = 2;
  heading("Against the textbook");
  for (const int landmarks : {100, 1000, 10'000}) {
    const bench::W1 work = bench::w1({.landmarks = landmarks});
    race(work, {textbook(work, 1000), ours(work, SlamMethod::fastslam1, thousand, ""),
                ours(work, SlamMethod::fastslam2, thousand, "")});
  }
  const bench::W1 work = bench::w1({});
  const bench::W1 wide = bench::w1({.landmarks = 1000});
  heading("Two threads");
  race(wide, {ours(wide, SlamMethod::fastslam1, thousand, ""),
              ours(wide, SlamMethod::fastslam1, by_two, " two threads")});
  race(wide, {ours(wide, SlamMethod::fastslam2, thousand, ""),
              ours(wide, SlamMethod::fastslam2, by_two, " two threads")});
  heading("Without names");
  for (const SlamMethod method : {SlamMethod::fastslam1, SlamMethod::fastslam2})
    race(wide, {ours(wide, method, thousand, ""), unidentified(wide, method, thousand)});
  heading("The swarm");
  race(work, {ours(work, SlamMethod::fastslam1, {.particles = 300}, ""),
              ours(work, SlamMethod::mapso, {.particles = 30}, ""),
              ours(work, SlamMethod::mapso_proposal, {.particles = 30}, "")});
  heading("ekf");
  race(work, {ours(work, SlamMethod::ekf, {}, "")});
  race(wide, {ours(wide, SlamMethod::ekf, {}, "")});
}

/// The greatest, from before there is a filter to after all steps, with a full map from the first on.
void print_memory(const bench::W1& work) {
  const SlamOptions options{.particles = 1000};
  peak_memory_MiB();
  const double before_MiB = peak_memory_MiB();
  Contender contender = ours(work, SlamMethod::fastslam1, options, "");
  double greatest_MiB = contender.memory_MiB;
  for (const SlamStep& step : work.steps) contender.step(step);
  greatest_MiB = std::max(greatest_MiB, peak_memory_MiB() - before_MiB);
  fmt::print("| {} | {} | {:.2f} |\n", work.landmarks.size(), work.steps.size(), greatest_MiB / 1024.0);
}

/// From 100 landmarks to 100 000; memory is that of a full map.
void widths() {
  heading("From narrow to wide");
  std::vector<bench::W1> works;
  for (const int landmarks : {100, 10'000, 100'000})
    works.push_back(bench::w1({.landmarks = landmarks, .steps = 10'000}));
  std::vector<Contender> contenders;
  for (const bench::W1& work : works)
    contenders.push_back(ours(work, SlamMethod::fastslam1, {.particles = 1000}, ""));
  for (int slice = 0; slice < kSlices; ++slice)
    for (std::size_t i = 0; i < works.size(); ++i) contenders[i].run_slice(works[i]);
  for (std::size_t i = 0; i < works.size(); ++i) print(works[i], contenders[i], contenders.front());
  contenders.clear();
  fmt::print("\n**Memory, N = 1000**\n\n| M | steps | GiB |\n|---|---|---|\n");
  print_memory(works.back());
}

double error_of(const bench::W1& work, const SlamOptions& options) {
  SlamFilter filter(work.sensor, options);
  double squares = 0.0;
  for (std::size_t k = 0; k < work.steps.size(); ++k) {
    filter.step(work.steps[k].motion, work.steps[k].observations);
    squares += (filter.estimate().pose.translation() - work.truth[k].translation()).squaredNorm();
  }
  return std::sqrt(squares / static_cast<double>(work.steps.size()));
}

void errors(int seeds) {
  fmt::print(
      "\n**Online position, rms [m], median of {} seeds, M = 100, N = 100**\n\n| filter | error "
      "|\n|---|---|\n",
      seeds);
  for (const SlamMethod method : {SlamMethod::fastslam1, SlamMethod::fastslam2, SlamMethod::mapso,
                                  SlamMethod::mapso_proposal, SlamMethod::ekf}) {
    std::vector<double> errors;
    for (int seed = 1; seed <= seeds; ++seed) {
      const auto s = static_cast<std::uint64_t>(seed);
      errors.push_back(error_of(bench::w1({.seed = s}),
                                {.method = method, .particles = 100, .seed = s, .keep_paths = false}));
    }
    fmt::print("| {} | {:.3f} |\n", name_of(method), median_of(errors));
  }
}

}  // namespace

int main(int argc, char** argv) {
  const int seeds = argc > 1 ? std::atoi(argv[1]) : 5;
  races();
  if (argc > 2 && std::string_view(argv[2]) == "wide") widths();
  if (seeds > 0) errors(seeds);
  return 0;
}
