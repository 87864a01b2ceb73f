// Landmark filters on workload W1 (w1.hpp), each measured in slices that take turns with the textbook's
// FastSLAM 1 (textbook_fastslam.hpp), so that what else the machine does touches all of them alike: the ratio
// is the median over the slices. Maps are filled with all landmarks before the clock starts; the estimate is
// read outside the clock.
//   slam_bench [seeds of the error table, default 5]
#include <algorithm>
#include <chrono>
#include <fstream>
#include <functional>
#include <numeric>

#include <fmt/format.h>

#include "trundle/slam/slam.hpp"

#include "textbook_fastslam.hpp"
#include "w1.hpp"

namespace {

using namespace trundle;

constexpr int kSlices = 5;

double median_of(std::vector<double> x) {
  std::ranges::nth_element(x, x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2));
  return x[x.size() / 2];
}

/// The highest of the process since the last call [MiB].
double peak_memory_MiB() {
  double peak_kB = 0.0;
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
  std::function<void(const SlamStep&)> step;
  std::function<Vector2()> position;
  double memory_MiB = 0.0;
  int slice = 400;                    ///< steps that it takes at a time
  std::vector<double> slice_us = {};  ///< per step
  std::vector<double> step_us = {};   ///< of all steps
  double squares = 0.0;               ///< of the position's error

  void run_slice(const bench::W1& work) {
    using Clock = std::chrono::steady_clock;
    double sum = 0.0;
    for (int i = 0; i < slice; ++i) {
      const std::size_t k = step_us.size();
      const SlamStep& given = work.steps[k];
      const auto start = Clock::now();
      step(given);
      step_us.push_back(1e6 * std::chrono::duration<double>(Clock::now() - start).count());
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
  double rms() const { return std::sqrt(squares / static_cast<double>(step_us.size())); }
};

Contender textbook(const bench::W1& work, std::size_t particles) {
  const double before = (peak_memory_MiB(), peak_memory_MiB());
  const bench::TextbookFastSlam::Noise noise{work.sigma_m, work.sigma_rad, work.sensor.range_sigma_m,
                                             work.sensor.bearing_sigma_rad};
  auto filter = std::make_shared<bench::TextbookFastSlam>(particles, work.landmarks.size(), noise);
  filter->step({}, work.all);
  Contender contender{"textbook", particles,
                      [filter](const SlamStep& step) { filter->step(step.motion.mean, step.observations); },
                      [filter] { return filter->mean(); }};
  if (work.landmarks.size() >= 10'000) contender.slice = 40;
  contender.memory_MiB = peak_memory_MiB() - before;
  return contender;
}

Contender ours(const bench::W1& work, SlamMethod method, const SlamOptions& base, const std::string& remark) {
  const double before = (peak_memory_MiB(), peak_memory_MiB());
  SlamOptions options = base;
  options.method = method;
  options.keep_paths = false;
  auto filter = std::make_shared<SlamFilter>(work.sensor, options);
  filter->step({}, work.all);
  Contender contender{std::string(name_of(method)) + remark, method == SlamMethod::ekf ? 1 : base.particles,
                      [filter](const SlamStep& step) { filter->step(step.motion, step.observations); },
                      [filter] { return filter->estimate().pose.translation(); }};
  contender.memory_MiB = peak_memory_MiB() - before;
  return contender;
}

void print(const bench::W1& work, const Contender& c, const Contender& yardstick) {
  std::vector<double> ratios;
  for (std::size_t i = 0; i < c.slice_us.size(); ++i)
    ratios.push_back((yardstick.slice_us[i] / static_cast<double>(yardstick.particles)) /
                     (c.slice_us[i] / static_cast<double>(c.particles)));
  const double step_us = median_of(c.slice_us);
  fmt::print("{:<24} {:>6} {:>6} {:>9.1f} {:>8.1f} {:>8.1f} {:>8.1f} {:>9.2f} {:>9.1f} {:>8.0f} {:>8.3f}\n",
             c.name, work.landmarks.size(), c.particles, step_us, c.quantile(0.5), c.quantile(0.99),
             c.quantile(1.0), 1e3 * step_us / (work.in_view * static_cast<double>(c.particles)),
             median_of(ratios), c.memory_MiB, c.rms());
}

void race(const bench::W1& work, std::vector<Contender> contenders) {
  for (int slice = 0; slice < kSlices; ++slice)
    for (Contender& contender : contenders) contender.run_slice(work);
  for (const Contender& contender : contenders) print(work, contender, contenders.front());
}

void races() {
  fmt::print("{:<24} {:>6} {:>6} {:>9} {:>8} {:>8} {:>8} {:>9} {:>9} {:>8} {:>8}\n", "filter", "M", "N",
             "us/step", "p50", "p99", "max", "ns/(N v)", "textb./it", "MiB", "rms [m]");
  const SlamOptions thousand{.particles = 1000};
  SlamOptions in_double = thousand;
  in_double.map_precision = Precision::float64;
  for (const int landmarks : {100, 1000, 10'000}) {
    const bench::W1 work = bench::w1({.landmarks = landmarks});
    race(work, {textbook(work, 1000), ours(work, SlamMethod::fastslam1, thousand, ""),
                ours(work, SlamMethod::fastslam1, in_double, " float64"),
                ours(work, SlamMethod::fastslam2, thousand, ""),
                ours(work, SlamMethod::fastslam2, in_double, " float64")});
  }
  const bench::W1 work = bench::w1({});
  race(work,
       {textbook(work, 300), ours(work, SlamMethod::fastslam1, {.particles = 300}, ""),
        ours(work, SlamMethod::mapso, {.particles = 30}, ""),
        ours(work, SlamMethod::mapso_proposal, {.particles = 30}, ""), ours(work, SlamMethod::ekf, {}, "")});
  const bench::W1 wide = bench::w1({.landmarks = 1000});
  race(wide, {textbook(wide, 100), ours(wide, SlamMethod::ekf, {}, "")});
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
  fmt::print("\n{:<16} {:>8} {:>6} {:>8} {:>10}   online position, rms [m], median; M = 100\n", "filter",
             "map", "N", "seeds", "error");
  for (const SlamMethod method : {SlamMethod::fastslam1, SlamMethod::fastslam2, SlamMethod::mapso,
                                  SlamMethod::mapso_proposal, SlamMethod::ekf})
    for (const Precision precision : {Precision::float32, Precision::float64}) {
      if (method == SlamMethod::ekf && precision == Precision::float32) continue;
      std::vector<double> errors;
      for (int seed = 1; seed <= seeds; ++seed) {
        const auto s = static_cast<std::uint64_t>(seed);
        errors.push_back(error_of(bench::w1({.seed = s}), {.method = method,
                                                           .particles = 100,
                                                           .seed = s,
                                                           .keep_paths = false,
                                                           .map_precision = precision}));
      }
      fmt::print("{:<16} {:>8} {:>6} {:>8} {:>10.3f}\n", name_of(method),
                 precision == Precision::float32 ? "float32" : "float64", 100, seeds, median_of(errors));
    }
}

}  // namespace

int main(int argc, char** argv) {
  races();
  errors(argc > 1 ? std::atoi(argv[1]) : 5);
  return 0;
}
