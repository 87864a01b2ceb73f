#include "trundle/slam/fastslam/particle_association.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

namespace trundle::slam {
namespace {

// Share of the sightings that are expected to show a new landmark, where each particle associates for itself:
// ν of eq. 54, of those that were tried the one with the least errors (docs/results/slam-without-names.md).
constexpr double kNewShare = 0.01;
// How much further all particles spread than the gating subset does: the furthest of N normal draws lies
// √(2 ln N) σ from the mean, so for N = 2000 against 32 it is √(ln 2000 / ln 32) = 1.5.
constexpr double kBeyondSample = 1.5;
// NIS grows with the square of the distance: some particle may be near what is twice as far from all members.
constexpr double kBetweenMembers = 4.0;
// Variance of a landmark that may be anywhere [m²]: (1 km)², so that a reading of it moves no particle.
constexpr double kAnywhere_m2 = 1e6;
// Of the weight: particles that have less between them create and keep no landmark. They die in the next
// resamplings, for of 100 particles it is one.
constexpr double kLeastWeightShare = 0.01;
// Sightings whose uniform numbers come from one draw, which yields three.
constexpr std::size_t kDrawnTogether = 3;

/// Covariance of (along, across) by the sensor's own uncertainty, that of a twist in its frame.
Matrix2 by_sensor(const SensorAt& sensor, const Sight& s, const Matrix3& covariance) {
  const double c = sensor.cos * s.ux + sensor.sin * s.uy;
  const double d = sensor.cos * s.uy - sensor.sin * s.ux;
  Matrix23 A;
  A << -c, -d, 0.0, d, -c, -s.range;
  return A * covariance * A.transpose();
}

/// What a particle makes of a reading of a landmark before it is drawn.
struct Expected {
  Vector2 innovation;  ///< (range, bearing) [m, rad]
  double nis;
};

// Eq. 11, 12, with the sensor's own uncertainty.
Expected expected_of(const SensorAt& sensor, const Matrix3& sensor_covariance, const ReadingTerms& reading,
                     const LandmarkEstimate& m) {
  const Sight s = sight_of(sensor, reading, m);
  Matrix2 S = by_sensor(sensor, s, sensor_covariance);
  S += (Matrix2() << s.p_along + s.r_along, s.p_mixed, s.p_mixed, s.p_across + s.r_across).finished();
  const Vector2 innovation(s.along, s.across);
  return {{s.along, s.across / s.range}, innovation.dot(S.inverse() * innovation)};
}

}  // namespace

ParticleAssociation::ParticleAssociation(const LandmarkSensor& sensor, std::size_t particles)
    : sensor_(sensor),
      particles_(particles),
      options_{.max_range_m = sensor.max_range_m, .new_share = kNewShare},
      grid_(kCellShare * sensor.max_range_m),
      visibility_(sensor.max_range_m),
      exclusion_(cost_of_new(options_)) {}

void ParticleAssociation::collect(std::span<const Observation> observations) {
  sightings_ = 0;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    if (observations[i].landmark >= 0 || !is_valid(observations[i])) continue;
    if (pool_.size() == sightings_) pool_.emplace_back();
    Sighting& sighting = pool_[sightings_++];
    sighting.observation = i;
    sighting.seen = observations[i];
    sighting.reading = reading_terms(observations[i], sensor_);
  }
}

void ParticleAssociation::find_candidates(ParticleBelief& belief, GatingSample& gating_sample) {
  reporter_ = belief.particles.best();
  while (chances_.size() * kDrawnTogether < sightings_) chances_.emplace_back(particles_);
  while (associated_.size() < sightings_) associated_.emplace_back(particles_);
  for (Sighting& sighting : sightings()) find_candidates(sighting, belief, gating_sample);
}

void ParticleAssociation::associate(const Sampling& sampling, ParticleSet& particles, ParticleRange block) {
  for (std::size_t k = 0; k < sightings_; ++k) {
    TripleColumns& chances = chances_[k / kDrawnTogether];
    if (k % kDrawnTogether == 0) {
      const auto purpose = static_cast<std::uint32_t>(1 + k / kDrawnTogether);
      draw_uniforms({sampling.draw.seed, sampling.draw.step, purpose}, block, chances);
    }
    choose_landmarks(pool_[k].reading,
                     {particles.sensors, sampling.sensor_covariance, options_, chances[k % kDrawnTogether],
                      particles.log_weights.data()},
                     block, pool_[k].may_show);
  }
}

void ParticleAssociation::resolve(const Matrix3& sensor_covariance, const SensorColumns& sensors,
                                  std::vector<KnownReading>& readings) {
  std::vector<Hypotheses*> all;
  for (Sighting& sighting : sightings()) all.push_back(&sighting.may_show);
  exclusion_.apply(all, particles_);
  for (std::size_t k = 0; k < sightings_; ++k) {
    Sighting& sighting = pool_[k];
    find_agreement(sighting);
    find_reported(sighting, sensors.in_world(reporter_), sensor_covariance);
    if (sighting.is_mapped) readings.push_back({sighting.reading, &associated_landmarks(k)});
  }
}

/// The landmarks that are near for some member of the gating subset, the likeliest first.
void ParticleAssociation::find_candidates(Sighting& sighting, ParticleBelief& belief,
                                          GatingSample& gating_sample) {
  auto& [particles, map, paths, pending] = belief;
  const double sigmas = std::sqrt(options_.near * options_.gate);
  const GatingSample::Spread points = gating_sample.spread_of(sighting.reading);
  const double radius = kBeyondSample * points.reach_m + sigmas * points.sigma_m;
  sighting.place = points.place;
  std::vector<std::size_t> near;
  grid_.near(points.place, radius + widest_m_, map.landmarks(), near);
  std::vector<std::pair<double, LandmarkId>> likely;
  for (const std::size_t index : near) {
    if ((grid_.place(index) - points.place).norm() > radius + entries_[index].slack_m) continue;
    const auto landmark = static_cast<LandmarkId>(index);
    const double nis = gating_sample.least_nis(sighting.reading, map.stored(landmark, particles.ancestry));
    if (nis <= kBetweenMembers * options_.near * options_.gate) likely.push_back({nis, landmark});
  }
  std::ranges::sort(likely);
  if (likely.size() > kMostCandidates) likely.resize(kMostCandidates);
  sighting.may_show.reset(particles_);
  for (const auto& [nis, landmark] : likely)
    sighting.may_show.add({landmark, &map.request(landmark, particles.ancestry)});
}

/// Puts a landmark into the grid, where the gating subset has it today.
void ParticleAssociation::locate(LandmarkId landmark, ParticleBelief& belief, GatingSample& gating_sample) {
  const auto index = static_cast<std::size_t>(landmark);
  const GatingSample::Spread spread =
      gating_sample.spread_of(belief.map.stored(landmark, belief.particles.ancestry));
  if (!spread.is_any) return;
  grid_.put(index, spread.place);
  entries_[index].slack_m =
      kBeyondSample * spread.reach_m + std::sqrt(options_.near * options_.gate) * spread.sigma_m;
  widest_m_ = std::max(widest_m_, entries_[index].slack_m);
  if (++located_ < entries_.size()) return;
  located_ = 0;
  widest_m_ = 0.0;
  for (const Entry& entry : entries_) widest_m_ = std::max(widest_m_, entry.slack_m);
}

/// Whether all particles associate a sighting alike, and whether some do with a landmark.
void ParticleAssociation::find_agreement(Sighting& sighting) const {
  const std::span choices(sighting.may_show.choices.data(), particles_);
  std::int32_t differences = 0;  // bits in which some choice differs from the first
  std::int32_t all = -1;         // bits that all have: the sign where none is a landmark
  for (const std::int32_t choice : choices) {
    differences |= choice ^ choices.front();
    all &= choice;
  }
  sighting.is_unanimous = differences == 0;
  sighting.is_mapped = all >= 0;
}

/// Innovation and NIS of the landmark that the reporter associates a sighting with; of the nearest where that
/// is ambiguous.
void ParticleAssociation::find_reported(Sighting& sighting, const SensorAt& sensor,
                                        const Matrix3& sensor_covariance) const {
  const std::int32_t choice = sighting.may_show.choices[reporter_];
  sighting.innovation = Vector2::Zero();
  sighting.nis = 0.0;
  for (const Candidate& candidate : sighting.may_show.candidates) {
    const LandmarkEstimate m = candidate.columns->at(reporter_);
    const bool is_reported = candidate.landmark == choice || choice == kAmbiguousLandmark;
    if (!is_reported || !is_there(m)) continue;
    const Expected expected = expected_of(sensor, sensor_covariance, sighting.reading, m);
    if (sighting.nis > 0.0 && expected.nis >= sighting.nis) continue;
    sighting.innovation = expected.innovation;
    sighting.nis = expected.nis;
  }
}

/// Of each particle the landmark that it associates a sighting with: one of the map where all agree, else
/// gathered from several.
LandmarkColumns& ParticleAssociation::associated_landmarks(std::size_t k) {
  const Sighting& sighting = pool_[k];
  const Hypotheses& may_show = sighting.may_show;
  if (sighting.is_unanimous) return *sighting.candidate(may_show.choices.front())->columns;
  LandmarkColumns& gathered = associated_[k];
  gathered.fill({sighting.place.x(), sighting.place.y(), kAnywhere_m2, 0.0, kAnywhere_m2});
  for (const Candidate& candidate : may_show.candidates)
    take_chosen(may_show.choices.data(), candidate, {0, padded(particles_)}, gathered);
  return gathered;
}

void ParticleAssociation::update_map(ParticleBelief& belief, GatingSample& gating_sample,
                                     StepReport& report) {
  ParticleSet& particles = belief.particles;
  const auto best = std::ranges::max_element(particles.log_weights) - particles.log_weights.begin();
  best_sensor_ = particles.poses.at(static_cast<std::size_t>(best)) * sensor_.body_from_sensor;
  for (std::size_t k = 0; k < sightings_; ++k) {
    const Sighting& sighting = pool_[k];
    const std::int32_t choice = sighting.may_show.choices[reporter_];
    report.observations[sighting.observation] = {choice >= 0 ? Decision::matched : Decision::rejected,
                                                 choice >= 0 ? belief.map.id_of(choice) : kUnknownLandmark,
                                                 sighting.innovation, sighting.nis};
    if (sighting.is_mapped && !sighting.is_unanimous) scatter_associated(k, particles);
    for (const Candidate& candidate : sighting.may_show.candidates)
      locate(candidate.landmark, belief, gating_sample);
    if (choice != kAmbiguousLandmark) visibility_.add_seen(sighting.seen.range_m, sighting.seen.bearing_rad);
    if (choice >= 0) belief.map.count_sighting(choice);
  }
  update_existence(belief);
}

void ParticleAssociation::create(ParticleBelief& belief, GatingSample& gating_sample, StepReport& report) {
  for (const Sighting& sighting : sightings()) {
    const double share = sighting.share_that_chose(kNewLandmark, belief.particles.weights);
    const bool is_reported = sighting.may_show.choices[reporter_] == kNewLandmark;
    if (share < kLeastWeightShare && !is_reported) continue;
    const LandmarkId landmark = create(sighting, belief, gating_sample);
    if (!is_reported) continue;
    report.observations[sighting.observation].decision = Decision::created;
    report.observations[sighting.observation].landmark = belief.map.id_of(landmark);
  }
}

/// What each particle has learned of its landmark goes back into the map; and those that saw none of theirs
/// are weighed by the density of a new landmark instead of that of one anywhere.
void ParticleAssociation::scatter_associated(std::size_t k, ParticleSet& particles) {
  const Sighting& sighting = pool_[k];
  for (const Candidate& candidate : sighting.may_show.candidates)
    take_chosen(sighting.may_show.choices.data(), {candidate.landmark, &associated_[k]},
                {0, padded(particles_)}, *candidate.columns);
  const double of_anywhere = std::log(sighting.seen.range_m / (2.0 * kPi * kAnywhere_m2));
  const double more = -0.5 * cost_of_new(options_) - of_anywhere;
  for (std::size_t i = 0; i < particles_; ++i)
    particles.log_weights[i] += sighting.may_show.choices[i] < 0 ? more : 0.0;
}

LandmarkId ParticleAssociation::create(const Sighting& sighting, ParticleBelief& belief,
                                       GatingSample& gating_sample) {
  auto& [particles, map, paths, pending] = belief;
  const LandmarkEstimate near = first_estimate(particles.sensors.in_world(reporter_), sighting.reading);
  const LandmarkId landmark = map.add_unidentified({near.x, near.y}, particles.ancestry);
  LandmarkColumns& columns = map.current(landmark, particles.ancestry);
  set_first_estimates(sighting.reading, particles.sensors, particles.all(), columns);
  for (std::size_t i = 0; i < particles_; ++i)
    if (sighting.may_show.choices[i] != kNewLandmark) columns.set(i, {near.x, near.y, kAbsent, 0.0, kAbsent});
  const auto index = static_cast<std::size_t>(landmark);
  if (entries_.size() <= index) entries_.resize(index + 1);
  entries_[index].existence = {0.0, best_sensor_.translation()};
  locate(landmark, belief, gating_sample);
  if (!grid_.contains(index)) grid_.put(index, {near.x, near.y});
  return landmark;
}

/// Landmarks that ought to be seen become less likely where most particles that have them do not see them;
/// those that no particle has any more go as well. Eq. 23.
void ParticleAssociation::update_existence(ParticleBelief& belief) {
  auto& [particles, map, paths, pending] = belief;
  const bool has_matched =
      std::ranges::any_of(sightings(), [&](const Sighting& s) { return s.may_show.choices[reporter_] >= 0; });
  if (!has_matched) return;
  const Vector2 from = best_sensor_.translation();
  const SensorAt sensor_of_reporter = particles.sensors.in_world(reporter_);
  std::vector<std::size_t> around;
  grid_.near(from, visibility_.reach_m(), map.landmarks(), around);
  for (const std::size_t index : around) {
    const ExpectedReading expected = expected_reading(best_sensor_, {}, grid_.place(index));
    Existence& existence = entries_[index].existence;
    if (!existence.has_parallax(from, expected.range_m)) continue;
    const auto landmark = static_cast<LandmarkId>(index);
    const double having = share_that_has(map.current(landmark, particles.ancestry), particles.weights);
    const bool is_seen = share_that_saw(landmark, particles.weights) > 0.5 * having;
    const Existence::ExpectedSighting expected_sighting{from, expected.range_m, expected.bearing_rad, is_seen,
                                                        !is_seen && fits_one(landmark, sensor_of_reporter)};
    if (having > kLeastWeightShare && existence.update(expected_sighting, visibility_)) continue;
    map.remove(landmark, particles.ancestry);
    grid_.remove(index);
    entries_[index] = {};
  }
}

/// Whether a sighting fits it, for the reporter, whatever that associates it with.
bool ParticleAssociation::fits_one(LandmarkId landmark, const SensorAt& sensor) const {
  return std::ranges::any_of(sightings(), [&](const Sighting& sighting) {
    const Candidate* candidate = sighting.candidate(landmark);
    if (candidate == nullptr) return false;
    const LandmarkEstimate m = candidate->columns->at(reporter_);
    return is_there(m) && expected_of(sensor, Matrix3::Zero(), sighting.reading, m).nis <= options_.gate;
  });
}

double ParticleAssociation::share_that_saw(LandmarkId landmark, const Column<double>& weights) const {
  double share = 0.0;
  for (const Sighting& sighting : sightings())
    if (sighting.candidate(landmark) != nullptr)
      share += sighting.share_that_chose(static_cast<std::int32_t>(landmark), weights);
  return share;
}

}  // namespace trundle::slam
