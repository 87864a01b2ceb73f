#include "trundle/slam/slam.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <numeric>
#include <variant>

#include "trundle/io/error.hpp"
#include "trundle/io/interruption.hpp"
#include "trundle/slam/ekf/ekf.hpp"
#include "trundle/slam/fastslam/particle_slam.hpp"
#include "trundle/slam/smoothing/incremental_smoother.hpp"
#include "trundle/statistics/median.hpp"

namespace trundle::slam {
namespace {

struct Method {
  SlamMethod method;
  std::string_view name;
  Proposal proposal;  ///< of the particle filters
};
constexpr std::array<Method, 6> kMethods = {{
    {SlamMethod::fastslam1, "fastslam1", Proposal::motion},
    {SlamMethod::fastslam2, "fastslam2", Proposal::linearised},
    {SlamMethod::mapso, "mapso", Proposal::swarm},
    {SlamMethod::mapso_proposal, "mapso_proposal", Proposal::swarm_gaussian},
    {SlamMethod::ekf, "ekf", Proposal::motion},
    {SlamMethod::smoother, "smoother", Proposal::motion},
}};

const Method& entry_of(SlamMethod method) {
  return *std::ranges::find(kMethods, method, &Method::method);
}

using Filters = std::variant<EkfSlam, ParticleSlam, IncrementalSmoother>;

Filters made(const LandmarkSensor& sensor, const SlamOptions& options) {
  if (options.method == SlamMethod::ekf)
    return EkfSlam(
        sensor,
        {.prior = options.prior, .gate = options.gate, .first_unidentified = options.first_unidentified});
  if (options.method == SlamMethod::smoother)
    return IncrementalSmoother(sensor, {.prior = options.prior,
                                        .has_bias = options.has_bias,
                                        .gate = options.gate,
                                        .window_s = options.window_s,
                                        .first_unidentified = options.first_unidentified});
  return ParticleSlam(sensor, {.proposal = entry_of(options.method).proposal,
                               .particles = options.particles,
                               .seed = options.seed,
                               .prior = options.prior,
                               .gate = options.gate,
                               .resample_below = options.resample_below,
                               .keep_paths = options.keep_paths,
                               .threads = options.threads,
                               .swarm = options.swarm,
                               .estimate = options.estimate.value_or(usual_estimate(options.method)),
                               .first_unidentified = options.first_unidentified});
}

/// Gathers SlamCounts.
class CountsOfRun {
 public:
  void add(const StepReport& report, std::size_t particles) {
    for (const ObservationReport& observation : report.observations) add(observation);
    counts_.resampled += report.resampled ? 1 : 0;
    if (report.effective_particles > 0.0)
      counts_.smallest_effective_share = std::min(
          counts_.smallest_effective_share, report.effective_particles / static_cast<double>(particles));
  }
  SlamCounts counts() {
    if (nis_.empty()) return counts_;
    counts_.mean_nis = std::accumulate(nis_.begin(), nis_.end(), 0.0) / static_cast<double>(nis_.size());
    counts_.median_nis = median(std::move(nis_));
    return counts_;
  }

 private:
  void add(const ObservationReport& observation) {
    switch (observation.decision) {
      case Decision::matched:
        ++counts_.matched;
        break;
      case Decision::created:
        ++counts_.created;
        return;
      case Decision::rejected:
        ++counts_.rejected;
        break;
      case Decision::invalid:
        ++counts_.invalid;
        return;
    }
    nis_.push_back(observation.nis);
  }

  SlamCounts counts_;
  std::vector<double> nis_;
};

StepTimes times_of(std::vector<double> seconds) {
  if (seconds.empty()) return {};
  std::ranges::sort(seconds);
  const std::size_t last = seconds.size() - 1;
  return {seconds[last / 2], seconds[last * 99 / 100], seconds[last]};
}

/// Those of its landmarks that are confirmed, or the others.
template <class Filter>
std::vector<MappedLandmark> landmarks_of(const Filter& filter, bool confirmed) {
  std::vector<MappedLandmark> landmarks;
  for (std::size_t i = 0; i < filter.landmarks(); ++i)
    if (filter.has_landmark(i) && filter.is_confirmed(i) == confirmed)
      landmarks.push_back(filter.landmark(i));
  return landmarks;
}

/// A path has the stamps of the online trajectory.
std::optional<Trajectory> with_stamps(const std::vector<Pose2>& path, const Trajectory& online) {
  if (path.empty()) return std::nullopt;
  Trajectory trajectory;
  for (std::size_t i = 0; i < path.size(); ++i) trajectory.poses.push_back({online.poses[i].time_s, path[i]});
  return trajectory;
}

}  // namespace

std::string_view name_of(SlamMethod method) {
  return entry_of(method).name;
}

std::optional<SlamMethod> slam_method_named(std::string_view name) {
  const auto at = std::ranges::find(kMethods, name, &Method::name);
  return at == kMethods.end() ? std::nullopt : std::optional(at->method);
}

std::vector<std::string> slam_method_names() {
  std::vector<std::string> names;
  for (const Method& method : kMethods) names.emplace_back(method.name);
  return names;
}

bool has_particles(SlamMethod method) {
  return method != SlamMethod::ekf && method != SlamMethod::smoother;
}

PointEstimate usual_estimate(SlamMethod method) {
  return method == SlamMethod::mapso ? PointEstimate::best : PointEstimate::mean;
}

SlamOptions slam_options_for(const SlamInput& input, SlamOptions options) {
  if (options.prior.systematic_sigma.size() == 0) options.prior.systematic_sigma = input.systematic.sigma();
  options.has_bias = input.systematic.has_bias;
  options.first_unidentified = std::max(options.first_unidentified, input.first_unidentified());
  return options;
}

struct SlamFilter::AnyFilter {
  Filters one;
};

SlamFilter::SlamFilter(const LandmarkSensor& sensor, const SlamOptions& options)
    : filter_(std::make_unique<AnyFilter>(AnyFilter{made(sensor, options)})) {}
SlamFilter::SlamFilter(const SlamFilter& other) : filter_(std::make_unique<AnyFilter>(*other.filter_)) {}
SlamFilter::SlamFilter(SlamFilter&& other) noexcept = default;
SlamFilter& SlamFilter::operator=(SlamFilter other) noexcept {
  filter_.swap(other.filter_);
  return *this;
}
SlamFilter::~SlamFilter() = default;

void SlamFilter::persist(io::StateWriter& archive, const SlamFilter& self) {
  std::visit([&](const auto& filter) { archive(filter); }, self.filter_->one);
}

void SlamFilter::persist(io::StateReader& archive, SlamFilter& self) {
  std::visit([&](auto& filter) { archive(filter); }, self.filter_->one);
}

const StepReport& SlamFilter::step(const Motion& motion, std::span<const Observation> observations) {
  return std::visit([&](auto& filter) -> const StepReport& { return filter.step(motion, observations); },
                    filter_->one);
}

const StepReport& SlamFilter::step(const SlamStep& step) {
  auto* smoother = std::get_if<IncrementalSmoother>(&filter_->one);
  const StepReport& report = smoother ? smoother->step(step.motion, step.observations, step.time_s)
                                      : this->step(step.motion, step.observations);
  if (step.bias_reading) read_bias(*step.bias_reading);
  return report;
}

void SlamFilter::read_bias(const BiasReading& reading) {
  std::visit([&](auto& filter) { filter.read_bias(reading); }, filter_->one);
}

PoseEstimate SlamFilter::estimate() const {
  return std::visit([](const auto& filter) { return filter.estimate(); }, filter_->one);
}

PoseEstimate SlamFilter::estimate_after(const Motion& motion) const {
  if (const auto* smoother = std::get_if<IncrementalSmoother>(&filter_->one))
    return smoother->estimate_after(motion);
  SlamFilter ahead = *this;
  ahead.step(motion, {});
  return ahead.estimate();
}

std::size_t SlamFilter::landmarks() const {
  return std::visit(
      [](const auto& filter) {
        std::size_t count = 0;
        for (std::size_t i = 0; i < filter.landmarks(); ++i)
          count += filter.has_landmark(i) && filter.is_confirmed(i) ? 1 : 0;
        return count;
      },
      filter_->one);
}

std::vector<MappedLandmark> SlamFilter::map() const {
  return std::visit([](const auto& filter) { return landmarks_of(filter, true); }, filter_->one);
}

Eigen::MatrixXd SlamFilter::map_covariance() const {
  return std::visit(
      [](const auto& filter) -> Eigen::MatrixXd {
        if constexpr (std::is_same_v<std::decay_t<decltype(filter)>, ParticleSlam>) {
          return {};
        } else {
          std::vector<std::size_t> confirmed;
          for (std::size_t i = 0; i < filter.landmarks(); ++i)
            if (filter.is_confirmed(i)) confirmed.push_back(i);
          return filter.map_covariance(confirmed);
        }
      },
      filter_->one);
}

LandmarkId SlamFilter::merged(LandmarkId id) const {
  const auto* smoother = std::get_if<IncrementalSmoother>(&filter_->one);
  return smoother ? smoother->merged(id) : id;
}

std::vector<MappedLandmark> SlamFilter::tentative() const {
  return std::visit([](const auto& filter) { return landmarks_of(filter, false); }, filter_->one);
}

std::vector<Pose2> SlamFilter::best_path() const {
  const auto* particles = std::get_if<ParticleSlam>(&filter_->one);
  return particles ? particles->best_path() : std::vector<Pose2>{};
}

std::vector<WeightedPose> SlamFilter::particles() const {
  const auto* particles = std::get_if<ParticleSlam>(&filter_->one);
  if (!particles) return {};
  const std::vector<Pose2> poses = particles->poses();
  const std::vector<double> weights = particles->weights();
  std::vector<WeightedPose> weighted;
  for (std::size_t i = 0; i < poses.size(); ++i) weighted.push_back({poses[i], weights[i]});
  return weighted;
}

const IncrementalSmoother* SlamFilter::smoother() const {
  return std::get_if<IncrementalSmoother>(&filter_->one);
}

LandmarkId SlamResult::last_landmark() const {
  LandmarkId greatest = kUnknownLandmark;
  for (const StepReport& report : reports)
    for (const ObservationReport& observation : report.observations)
      greatest = std::max(greatest, observation.landmark);
  return greatest;
}

std::vector<MappedLandmark> map_with(const Eigen::MatrixXd& covariance, const SlamFilter& filter) {
  std::vector<MappedLandmark> map = filter.map();
  if (covariance.size() == 0) return map;
  for (std::size_t i = 0; i < map.size(); ++i) {
    const auto at = 2 * static_cast<Eigen::Index>(i);
    map[i].covariance = covariance.block<2, 2>(at, at);
  }
  return map;
}

SlamRun::SlamRun(const LandmarkSensor& sensor, const SlamOptions& options)
    : particles_(options.particles),
      keep_growth_(options.keep_growth),
      judge_fit_(options.judge_fit),
      filter_(sensor, options) {}

void SlamRun::step(const SlamStep& step) {
  check_interruption();
  using Clock = std::chrono::steady_clock;
  const Clock::time_point before = Clock::now();
  reports_.push_back(filter_.step(step));
  const PoseEstimate estimate = filter_.estimate();
  if (!step.observations.empty())
    seconds_.push_back(std::chrono::duration<double>(Clock::now() - before).count());
  moved_m_.push_back(moved_m(step, estimate));
  systematic_ = estimate.systematic;
  online_.poses.push_back({step.time_s, estimate.pose});
  online_.covariances.push_back(estimate.covariance);
  if (estimate.systematic.size() > 0)
    bias_.push_back({estimate.systematic[0], estimate.systematic_covariance(0, 0)});
  if (keep_growth_ && filter_.smoother()) growth_.add(*filter_.smoother(), step.time_s);
}

/// From where the motion alone would have taken it, with what was known of its errors.
double SlamRun::moved_m(const SlamStep& step, const PoseEstimate& estimate) const {
  if (step.observations.empty() || online_.poses.empty()) return 0.0;
  const Pose2 expected = online_.poses.back().pose * about(systematic_, step.motion).mean;
  return (estimate.pose.translation() - expected.translation()).norm();
}

SlamResult SlamRun::result() const {
  SlamResult result;
  result.online = online_;
  result.path = with_stamps(filter_.best_path(), online_);
  result.last = filter_.estimate();
  result.map_covariance = filter_.map_covariance();
  result.map = map_with(result.map_covariance, filter_);
  result.tentative = filter_.tentative();
  result.particles = filter_.particles();
  result.reports = reports_;
  for (StepReport& report : result.reports)
    for (ObservationReport& observation : report.observations)
      observation.landmark = filter_.merged(observation.landmark);
  result.moved_m = moved_m_;
  if (keep_growth_ && filter_.smoother() && !online_.poses.empty())
    result.growth = growth_.with_last(*filter_.smoother(), online_.poses.back().time_s);
  result.bias = bias_;
  CountsOfRun counter;
  for (const StepReport& report : reports_) counter.add(report, particles_);
  result.counts = counter.counts();
  if (judge_fit_ && filter_.smoother()) result.fit = fit_of(*filter_.smoother());
  result.step_times = times_of(seconds_);
  return result;
}

SlamResult slam(const SlamInput& input, const LandmarkSensor& sensor, const SlamOptions& options) {
  SlamRun run(sensor, slam_options_for(input, options));
  for (const SlamStep& step : input.steps) run.step(step);
  return run.result();
}

}  // namespace trundle::slam
