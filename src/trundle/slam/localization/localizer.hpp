#pragma once

#include <optional>
#include <string_view>
#include <variant>

#include "trundle/geometry/trajectory.hpp"
#include "trundle/slam/localization/pose_hypotheses.hpp"
#include "trundle/slam/localization/pose_particles.hpp"
#include "trundle/slam/steps.hpp"

namespace trundle::slam {

/// How a known pose is followed.
enum class LocalizerFilter {
  ekf,        ///< by one Gaussian: PoseEkf
  particles,  ///< by the same, and by PoseParticles while the pose is so vague that one will not do
};
[[nodiscard]] std::string_view name_of(LocalizerFilter filter);

/// Of a localizer.
struct LocalizerOptions {
  LocalizerFilter filter = LocalizerFilter::particles;
  std::optional<PoseEstimate> start = {};  ///< nothing: the pose is found
  Systematic systematic_sigma = {};        ///< 1σ of each of the odometry's systematic errors
  MapSightOptions sight = {};
  ParticleNumber particles = {};
  std::uint64_t seed = 1;
  double error_probability = 0.01;    ///< a pose is known when the probability that it is wrong is below
  double false_alarm_interval = 1e7;  ///< sightings between alarms, at least, of a robot that is not lost
};

/// Where the localizer stands after a step.
enum class LocalizerPhase {
  searching,  ///< the pose is not known
  found,      ///< it has become known in this step
  tracking,   ///< it is known
  lost,       ///< it was thought to be known until this step
};

[[nodiscard]] std::string_view name_of(LocalizerPhase phase);

/// Evidence of one step.
struct LocalizerReport {
  LocalizerPhase phase = LocalizerPhase::searching;
  std::vector<ObservationReport>
      observations;                  ///< as they were given; all invalid while searching; so are repeats
  double alarm = 0.0;                ///< the sequential test's sum, of which 1 is the limit; eq. 53
  std::size_t hypotheses = 0;        ///< poses in question beside the one that is known
  std::size_t particles = 0;         ///< 0: the filter has none
  double effective_particles = 0.0;  ///< 1/Σw² after the step; 0: the filter has none

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.phase, self.observations, self.alarm, self.hypotheses, self.particles,
            self.effective_particles);
  }
};

/// Finds the pose on a known map, follows it, and notices when it is not there any more: a robot that was
/// carried away, a wrong start. Each step takes bounded time. docs/theory/global-localization.md.
class Localizer {
 public:
  /// The map must outlive the localizer. A copy continues independently. Throws InputError when there may be
  /// no particle.
  Localizer(const KnownMap& map, const LandmarkSensor& sensor, const LocalizerOptions& options);

  const LocalizerReport& step(const Motion& motion, std::span<const Observation> observations);

  /// What the gyro reads at rest, after a step.
  void read_bias(const BiasReading& reading);

  /// Nothing while the pose is not known.
  [[nodiscard]] std::optional<PoseEstimate> estimate() const;
  /// After `lost`: so many steps ago the pose was still right.
  [[nodiscard]] std::uint64_t unconfirmed_steps() const { return seen_.now() - confirmed_step_; }

  /// Its state, for io/archive.hpp: a localizer of the same map, sensor and options continues with it to the
  /// last bit.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    bool is_known = self.is_known();
    bool has_particles = std::holds_alternative<PoseParticles>(self.filter_);
    archive(is_known, has_particles);
    if constexpr (Archive::kReads) {
      self.forget();
      if (is_known) self.follow_by_gaussian({});
      if (has_particles) self.follow_by_particles({});
    }
    archive(self.seen_, self.odometry_, self.hypotheses_, self.was_ambiguous_, self.log_odds_, self.alarm_,
            self.confirmed_step_, self.report_);
    if (auto* ekf = std::get_if<PoseEkf>(&self.filter_)) archive(*ekf);
    if (auto* particles = std::get_if<PoseParticles>(&self.filter_)) archive(*particles);
  }

 private:
  [[nodiscard]] bool is_known() const { return !std::holds_alternative<std::monostate>(filter_); }
  void forget() { filter_ = std::monostate{}; }
  [[nodiscard]] double limit() const;
  void follow_by_gaussian(const PoseEstimate& pose);
  void follow_by_particles(const PoseEstimate& pose);
  void choose_filter(const Motion& motion, std::span<const Observation> observations);
  void track(const Motion& motion, std::span<const Observation> observations);
  void search_alternatives();
  [[nodiscard]] double log_odds_against_new() const;
  struct Candidate {
    PoseEstimate pose;
    double log_odds;
    double alarm;
  };
  [[nodiscard]] std::optional<Candidate> most_probable() const;
  [[nodiscard]] double probability() const;
  void accept();
  void check();
  void start_from(const TrackedHypothesis& hypothesis);

  const KnownMap* map_;
  LandmarkSensor sensor_;
  LocalizerOptions options_;
  LocalMap seen_;
  PoseEstimate odometry_;  ///< of its systematic errors, what standing still has shown
  std::variant<std::monostate, PoseEkf, PoseParticles> filter_;
  PoseHypotheses hypotheses_;   ///< all poses in question but the one that is known
  bool was_ambiguous_ = false;  ///< the last search: not all places were tried that explain what was seen
  double log_odds_ = 0.0;       ///< of the one that is known
  double alarm_ = 0.0;
  std::uint64_t confirmed_step_ = 0;  ///< the last with a sighting that fitted and nothing against the pose
  LocalizerReport report_;
};

/// A stretch of a recording over which the pose is known.
struct KnownStretch {
  double start_s = 0.0;
  double end_s = 0.0;               ///< the last sighting that fitted, with nothing against it
  std::optional<double> noticed_s;  ///< when that was noticed; nothing: it lasts to the end
};

/// Sightings of a whole recording by what became of them.
struct LocalizationCounts {
  std::size_t matched = 0;
  std::size_t rejected = 0;
  std::size_t invalid = 0;              ///< no numbers, or no sensible ones
  std::size_t unmapped = 0;             ///< their names are not in the map
  std::size_t searching = 0;            ///< seen while the pose was not known
  std::optional<double> mean_nis = {};  ///< of matched sightings; 2 if consistent; nothing: there are none
  std::optional<double> median_nis = {};
  std::size_t most_particles = 0;
};

/// A whole recording, localized.
struct Localization {
  Trajectory trajectory;  ///< online estimate, where it is known; with covariance
  std::vector<KnownStretch> stretches;
  std::vector<double> refuted_s;         ///< when what nothing had ever confirmed was withdrawn, all of it
  std::vector<LocalizerReport> reports;  ///< one for each step
  LocalizationCounts counts;
};

/// A loop over Localizer::step. What an alarm has shown to be wrong is withdrawn: no row of the trajectory
/// lies outside the stretches. Where the options have no systematic errors, they are those of the input.
[[nodiscard]] Localization localize(const SlamInput& input, const KnownMap& map, const LandmarkSensor& sensor,
                                    const LocalizerOptions& options);

}  // namespace trundle::slam
