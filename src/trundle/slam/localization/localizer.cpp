#include "trundle/slam/localization/localizer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "trundle/io/error.hpp"
#include "trundle/io/interruption.hpp"
#include "trundle/statistics/median.hpp"

namespace trundle::slam {
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
    result_.reports.push_back(report);
    if (report.phase == LocalizerPhase::lost) return withdraw(step.time_s, localizer.unconfirmed_steps());
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
      counts.mean_nis = std::accumulate(nis_.begin(), nis_.end(), 0.0) / static_cast<double>(nis_.size());
      counts.median_nis = median(std::move(nis_));
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

  /// Rows after the last sighting that fitted with nothing against it: all, where nothing ever confirmed the
  /// start. A start that the very first sightings refute has no row yet.
  void withdraw(double now_s, std::uint64_t steps) {
    if (result_.stretches.empty() || result_.stretches.back().noticed_s) return;
    KnownStretch& stretch = result_.stretches.back();
    const std::size_t sure = times_.size() - std::min<std::size_t>(times_.size(), steps);
    auto& [poses, covariances] = result_.trajectory;
    while (!poses.empty() && poses.back().time_s >= stretch.start_s &&
           (sure == 0 || poses.back().time_s > times_[sure - 1])) {
      poses.pop_back();
      covariances.pop_back();
    }
    if (poses.empty() || poses.back().time_s < stretch.start_s) {
      result_.refuted_s.push_back(now_s);
      result_.stretches.pop_back();
    } else {
      stretch.end_s = poses.back().time_s;
      stretch.noticed_s = now_s;
    }
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

std::string_view name_of(LocalizerPhase phase) {
  constexpr std::array<std::string_view, 4> kNames = {"searching", "found", "tracking", "lost"};
  return kNames[static_cast<std::size_t>(phase)];
}

Localizer::Localizer(const KnownMap& map, const LandmarkSensor& sensor, const LocalizerOptions& options)
    : map_(&map), sensor_(sensor), options_(options), seen_(sensor), hypotheses_(map, sensor, options.sight) {
  if (options.filter == LocalizerFilter::particles && options.particles.most == 0)
    throw InputError("localizer", "may have 0 particles at most", "at least 1");
  const Systematic& sigma = options.systematic_sigma;
  odometry_.systematic = Systematic::Zero(sigma.size());
  odometry_.systematic_covariance = sigma.cwiseAbs2().asDiagonal();
  odometry_.with_systematic = BySystematic::Zero(3, sigma.size());
  if (options.start)
    start_from(
        {PoseEkf(map, sensor, with_systematic(*options.start, odometry_), options.sight), limit(), 0.0});
}

/// What speaks so much against a pose makes it a wrong one.
double Localizer::limit() const {
  return std::log(options_.false_alarm_interval);
}

const LocalizerReport& Localizer::step(const Motion& motion, std::span<const Observation> observations) {
  report_ = {};
  report_.observations.assign(observations.size(), {});
  const std::vector<Observation> once = without_repeats(observations);
  seen_.step(about(odometry_.systematic, motion), once, odometry_.systematic_covariance);
  if (odometry_.systematic.size() > 0) odometry_.systematic_covariance(0, 0) += motion.walk;
  hypotheses_.step(motion, once, seen_.novelty());
  if (is_known()) track(motion, once);
  search_alternatives();
  is_known() ? check() : accept();
  report_.hypotheses = hypotheses_.all().size();
  if (const auto* particles = std::get_if<PoseParticles>(&filter_))
    report_.effective_particles = particles->effective_particles();
  return report_;
}

void Localizer::read_bias(const BiasReading& reading) {
  seen_.read_bias(reading, odometry_.systematic, odometry_.systematic_covariance);
  trundle::slam::read_bias(reading, odometry_);
  hypotheses_.read_bias(reading);
  if (auto* ekf = std::get_if<PoseEkf>(&filter_)) ekf->read_bias(reading);
  if (auto* particles = std::get_if<PoseParticles>(&filter_)) particles->read_bias(reading);
}

void Localizer::start_from(const TrackedHypothesis& hypothesis) {
  filter_ = hypothesis.filter;
  log_odds_ = hypothesis.log_odds;
  alarm_ = hypothesis.alarm;
  confirmed_step_ = seen_.now();
}

void Localizer::follow_by_gaussian(const PoseEstimate& pose) {
  filter_ = PoseEkf(*map_, sensor_, pose, options_.sight);
}

void Localizer::follow_by_particles(const PoseEstimate& pose) {
  filter_ = PoseParticles(
      *map_, sensor_, pose,
      {.sight = options_.sight, .number = options_.particles, .seed = options_.seed + seen_.now()});
}

/// One Gaussian, which knows what is wrong with the map, where one will do; particles from where the pose is
/// so vague that readings without names may show any of several landmarks, until it is one place again.
void Localizer::choose_filter(const Motion& motion, std::span<const Observation> observations) {
  if (options_.filter == LocalizerFilter::ekf) return;
  const PoseEstimate pose = *estimate();
  if (const auto* ekf = std::get_if<PoseEkf>(&filter_)) {
    if (ekf->is_ambiguous(motion, observations)) follow_by_particles(pose);
  } else if (is_one_place(pose, options_.sight.same)) {
    follow_by_gaussian(pose);
  }
}

/// Eq. 53: a sum of log likelihood ratios that never falls below 0.
void Localizer::track(const Motion& motion, std::span<const Observation> observations) {
  choose_filter(motion, observations);
  const auto step = [&](auto& filter) -> const MapStepReport* {
    if constexpr (std::is_same_v<std::decay_t<decltype(filter)>, std::monostate>)
      return nullptr;
    else
      return &filter.step(motion, observations, seen_.novelty());
  };
  const MapStepReport& found = *std::visit(step, filter_);
  report_.observations = found.observations;
  report_.particles = found.particles;
  log_odds_ -= found.new_evidence_against;
  alarm_ = std::max(0.0, alarm_ + found.against);
  hypotheses_.remove(estimate()->pose);
}

/// Eq. 56: whoever is in question already has been right before as well, and was thought more probable then.
void Localizer::search_alternatives() {
  if (std::ranges::all_of(seen_.novelty(), [](double share) { return share == 0.0; })) return;
  if (is_known() && alarm_ == 0.0) return;
  double log_prior = 0.0;
  if (const auto first = most_probable()) {
    const double before = first->log_odds - log_odds_at(first->pose, seen_, *map_, sensor_, options_.sight);
    log_prior = before - std::clamp(before, 0.0, log_odds_against_new());
  }
  const FoundPoses found = find_poses(seen_, *map_, sensor_, options_.sight);
  was_ambiguous_ = found.is_ambiguous;
  hypotheses_.admit(found.poses, log_prior, odometry_);
  if (is_known()) hypotheses_.remove(estimate()->pose);
  if (const auto first = most_probable()) hypotheses_.remove(first->log_odds - limit(), limit());
}

/// What a new hypothesis has to make up for: that the robot would have to have been carried there, or that
/// nothing had suggested that place before, where it would have been.
double Localizer::log_odds_against_new() const {
  if (is_known()) return limit();
  return was_ambiguous_ ? 0.0 : -std::log(options_.error_probability);
}

/// The pose that is known, or else the first hypothesis.
std::optional<Localizer::Candidate> Localizer::most_probable() const {
  if (is_known()) return Candidate{*estimate(), log_odds_, alarm_};
  if (hypotheses_.all().empty()) return std::nullopt;
  const TrackedHypothesis& first = hypotheses_.all().front();
  return Candidate{first.filter.estimate(), first.log_odds, first.alarm};
}

/// Eq. 57: probability of the most probable pose.
double Localizer::probability() const {
  const auto first = most_probable();
  if (!first) return 0.0;
  double all = 1.0 + std::exp(-std::min(first->log_odds, limit() - first->alarm));
  for (const TrackedHypothesis& hypothesis : hypotheses_.all().subspan(is_known() ? 0 : 1))
    all += std::exp(hypothesis.log_odds - first->log_odds);
  return 1.0 / all;
}

void Localizer::accept() {
  report_.phase = LocalizerPhase::searching;
  if (probability() < 1.0 - options_.error_probability) return;
  start_from(hypotheses_.take_first());
  report_.phase = LocalizerPhase::found;
}

/// Whether what was thought to be known still is.
void Localizer::check() {
  report_.phase = LocalizerPhase::tracking;
  report_.alarm = alarm_ / limit();
  const double p = probability();
  const bool matches =
      std::ranges::count(report_.observations, Decision::matched, &ObservationReport::decision) > 0;
  if (matches && alarm_ == 0.0 && p >= 1.0 - options_.error_probability) confirmed_step_ = seen_.now();
  if (alarm_ < limit() && p >= 0.5) return;
  report_.phase = LocalizerPhase::lost;
  if (alarm_ < limit())
    hypotheses_.add({PoseEkf(*map_, sensor_, *estimate(), options_.sight), log_odds_, alarm_});
  else
    seen_.forget_before(confirmed_step_ + 1);
  forget();
}

std::optional<PoseEstimate> Localizer::estimate() const {
  if (const auto* ekf = std::get_if<PoseEkf>(&filter_)) return ekf->estimate();
  if (const auto* particles = std::get_if<PoseParticles>(&filter_)) return particles->estimate();
  return std::nullopt;
}

Localization localize(const SlamInput& input, const KnownMap& map, const LandmarkSensor& sensor,
                      const LocalizerOptions& options) {
  LocalizerOptions known = options;
  if (known.systematic_sigma.size() == 0) known.systematic_sigma = input.systematic.sigma();
  Localizer localizer(map, sensor, known);
  Collector collector(map);
  for (const SlamStep& step : input.steps) {
    check_interruption();
    const LocalizerReport& report = localizer.step(step.motion, step.observations);
    if (step.bias_reading) localizer.read_bias(*step.bias_reading);
    collector.add(step, localizer, report);
  }
  return collector.result();
}

}  // namespace trundle::slam
