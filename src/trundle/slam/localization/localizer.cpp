#include "trundle/slam/localization/localizer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "trundle/io/error.hpp"

namespace trundle {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr Observation kNoReading{kUnknownLandmark, kNan, kNan};

/// A reading that repeats another of the same instant is no evidence: it becomes invalid.
std::vector<Observation> without_repeats(std::span<const Observation> observations) {
  std::vector<Observation> once;
  for (const Observation& observation : observations) {
    const bool repeated = std::ranges::any_of(once, [&](const Observation& o) {
      return o.landmark == observation.landmark && o.range_m == observation.range_m &&
             o.bearing_rad == observation.bearing_rad;
    });
    once.push_back(repeated ? kNoReading : observation);
  }
  return once;
}

/// Gathers what a whole recording shows.
class Collector {
 public:
  Collector(const KnownMap& map) : map_(map) {}

  void add(const SlamStep& step, const Localizer& localizer, const LocalizerReport& report) {
    count(step, report);
    times_.push_back(step.time_s);
    if (report.phase == LocalizerPhase::lost) return withdraw(step.time_s, localizer.doubtful_steps());
    const auto estimate = localizer.estimate();
    if (!estimate) return;
    if (result_.stretches.empty() || result_.stretches.back().noticed_s)
      result_.stretches.push_back({step.time_s, step.time_s, std::nullopt});
    result_.stretches.back().end_s = step.time_s;
    result_.trajectory.poses.push_back({step.time_s, estimate->pose});
    result_.trajectory.covariances.push_back(estimate->covariance);
  }

  Localization result() {
    LocalizationCounts& counts = result_.counts;
    if (!nis_.empty()) {
      for (const double nis : nis_) counts.mean_nis += nis / static_cast<double>(nis_.size());
      const auto middle = nis_.begin() + static_cast<std::ptrdiff_t>(nis_.size() / 2);
      std::ranges::nth_element(nis_, middle);
      counts.median_nis = *middle;
    }
    return std::move(result_);
  }

 private:
  void count(const SlamStep& step, const LocalizerReport& report) {
    LocalizationCounts& counts = result_.counts;
    counts.most_particles = std::max(counts.most_particles, report.particles);
    const bool tracked = report.phase == LocalizerPhase::tracking || report.phase == LocalizerPhase::lost;
    for (std::size_t i = 0; i < step.observations.size(); ++i) {
      const Observation& observation = step.observations[i];
      if (!is_valid(observation)) {
        ++counts.invalid;
      } else if (observation.landmark != kUnknownLandmark && !map_.has(observation.landmark)) {
        ++counts.unmapped;
      } else if (!tracked) {
        ++counts.searching;
      } else if (report.observations[i].decision == Decision::matched) {
        ++counts.matched;
        nis_.push_back(report.observations[i].nis);
      } else {
        ++counts.rejected;
      }
    }
  }

  /// Rows after the last at which nothing spoke against them: all, where nothing ever confirmed the start.
  void withdraw(double now_s, std::uint64_t steps) {
    KnownStretch& stretch = result_.stretches.back();
    const std::size_t sure = times_.size() - std::min<std::size_t>(times_.size(), steps);
    auto& [poses, covariances] = result_.trajectory;
    while (!poses.empty() && poses.back().time_s >= stretch.start_s &&
           (sure == 0 || poses.back().time_s > times_[sure - 1])) {
      poses.pop_back();
      covariances.pop_back();
    }
    if (poses.empty() || poses.back().time_s < stretch.start_s)
      stretch.end_s = stretch.start_s;
    else
      stretch.end_s = poses.back().time_s;
    stretch.noticed_s = now_s;
  }

  const KnownMap& map_;
  std::vector<double> times_;
  std::vector<double> nis_;
  Localization result_;
};

}  // namespace

std::string_view name_of(LocalizerFilter filter) {
  return filter == LocalizerFilter::ekf ? "ekf" : "particles";
}

Localizer::Localizer(const KnownMap& map, const LandmarkSensor& sensor, const LocalizerOptions& options)
    : map_(&map), sensor_(sensor), options_(options), seen_(sensor) {
  if (options.filter == LocalizerFilter::particles && options.particles.most == 0)
    throw InputError("localizer", "may have 0 particles at most", "at least 1");
  if (options.start) start_from(*options.start);
}

const LocalizerReport& Localizer::step(const Motion& motion, std::span<const Observation> observations) {
  report_ = {};
  report_.observations.assign(observations.size(), {});
  const std::vector<Observation> once = without_repeats(observations);
  seen_.step(motion, once);
  if (is_known())
    track(motion, once);
  else
    search(once);
  if (const auto* particles = std::get_if<PoseParticles>(&filter_))
    report_.particles = particles->poses().size();
  return report_;
}

void Localizer::search(std::span<const Observation> observations) {
  report_.phase = LocalizerPhase::searching;
  if (observations.empty() || seen_.fresh() == 0) return;
  const auto hypotheses = find_poses(seen_, *map_, sensor_, options_.sight);
  report_.hypotheses = hypotheses.size();
  if (certainty_of_first(hypotheses) < 1.0 - options_.doubt) return;
  start_from(hypotheses);
  report_.phase = LocalizerPhase::found;
}

void Localizer::start_from(std::span<const PoseHypothesis> hypotheses) {
  if (options_.filter == LocalizerFilter::ekf)
    filter_.emplace<PoseEkf>(*map_, sensor_, hypotheses.front().pose, options_.sight);
  else
    filter_.emplace<PoseParticles>(
        *map_, sensor_, hypotheses,
        PoseParticlesOptions{
            .sight = options_.sight, .number = options_.particles, .seed = options_.seed + seen_.now()});
  alarm_ = 0.0;
  sure_step_ = seen_.now();
}

/// What is known at the start is a Gaussian: one hypothesis.
void Localizer::start_from(const PoseEstimate& pose) {
  start_from(std::vector<PoseHypothesis>{{pose, 0.0, 0}});
}

/// Eq. 53: a sum of log likelihood ratios that never falls below 0.
void Localizer::track(const Motion& motion, std::span<const Observation> observations) {
  const auto step = [&](auto& filter) -> const MapStepReport* {
    if constexpr (std::is_same_v<std::decay_t<decltype(filter)>, std::monostate>)
      return nullptr;
    else
      return &filter.step(motion, observations);
  };
  const MapStepReport& found = *std::visit(step, filter_);
  report_.observations = found.observations;
  report_.phase = LocalizerPhase::tracking;
  alarm_ = std::max(0.0, alarm_ + found.against);
  if (alarm_ == 0.0) sure_step_ = seen_.now();
  const double limit = std::log(options_.false_alarm_interval);
  report_.alarm = alarm_ / limit;
  if (alarm_ < limit) return;
  report_.phase = LocalizerPhase::lost;
  seen_.forget_before(sure_step_ + 1);
  forget();
}

std::optional<PoseEstimate> Localizer::estimate() const {
  if (const auto* ekf = std::get_if<PoseEkf>(&filter_)) return ekf->estimate();
  if (const auto* particles = std::get_if<PoseParticles>(&filter_)) return particles->estimate();
  return std::nullopt;
}

Localization localize(const SlamInput& input, const KnownMap& map, const LandmarkSensor& sensor,
                      const LocalizerOptions& options) {
  Localizer localizer(map, sensor, options);
  Collector collector(map);
  for (const SlamStep& step : input.steps) {
    const LocalizerReport& report = localizer.step(step.motion, step.observations);
    collector.add(step, localizer, report);
  }
  return collector.result();
}

}  // namespace trundle
