// What particles know: their estimates, with what they have forgotten, and loops closed in spite of that.
#include <Eigen/Cholesky>

#include "trundle/slam/cholesky.hpp"
#include "trundle/slam/particles/particle_slam.hpp"

namespace trundle {
namespace {

/// Of a body's place.
bool is_less(const MapDoubt& one, const MapDoubt& other, const Pose2& pose) {
  const auto variance = [&](const MapDoubt& doubt) {
    return doubt.about(pose.translation()).covariance.topLeftCorner<2, 2>().trace();
  };
  return variance(one) < variance(other);
}

}  // namespace

/// Headings are averaged as differences to the best particle's.
PoseEstimate ParticleSlam::estimate() const {
  PoseColumns now(options_.particles);
  predict(poses_, systematic_, pending_, all(), now);
  const double heading = now.at(best_particle()).heading;
  const auto numbers_of = [&](std::size_t i) {
    const Pose2 pose = now.at(i);
    return Vector3(pose.x, pose.y, heading + wrap_angle(pose.heading - heading));
  };
  Vector3 mean = Vector3::Zero();
  for (std::size_t i = 0; i < options_.particles; ++i) mean += weights_[i] * numbers_of(i);
  PoseEstimate estimate;
  estimate.pose = {mean.x(), mean.y(), mean.z()};
  estimate.covariance = world_covariance({estimate.pose, predicted_covariance()});
  for (std::size_t i = 0; i < options_.particles; ++i) estimate.systematic += weights_[i] * systematic_.at(i);
  estimate.systematic_covariance = systematic_covariance_;
  for (std::size_t i = 0; i < options_.particles; ++i) {
    const Vector3 apart = numbers_of(i) - mean;
    estimate.covariance += weights_[i] * apart * apart.transpose();
    const Systematic unlike = systematic_.at(i) - estimate.systematic;
    estimate.systematic_covariance += weights_[i] * unlike * unlike.transpose();
  }
  estimate.covariance += forgotten_.beyond_scatter(estimate.pose.translation());
  return estimate;
}

MappedLandmark ParticleSlam::landmark(std::size_t index) const {
  return map_.mixture(static_cast<LandmarkId>(index), weights_, ancestry_, forgotten_);
}

/// Eq. 61, after a resampling.
void ParticleSlam::keep_doubt() {
  const double share = kinship_.share_lost(ancestry_);
  std::vector<LandmarkId> in_view;
  std::vector<std::vector<Vector2>> places;
  for (const ObservationReport& seen : report_.observations) {
    const LandmarkId landmark =
        seen.decision == Decision::matched ? map_.number_of(seen.landmark) : kUnknownLandmark;
    if (landmark < 0) continue;
    in_view.push_back(landmark);
    if (places.size() == kLandmarksOfScatter) continue;
    const ParticleMap::Inherited inherited = map_.inherited(landmark, ancestry_);
    std::vector<Vector2> of_particles = some_places(inherited.columns, inherited.from, options_.particles);
    if (!of_particles.empty()) places.push_back(std::move(of_particles));
  }
  const std::optional<MapDoubt> left = map_scatter(places);
  if (!left) return;
  const MapDoubt whole = forgotten_.forget(*left, share);
  for (const LandmarkId landmark : in_view) map_.set_doubt(landmark, whole);
}

/// The map where the robot is, with what the motion since it was last looked at may have erred by.
PieceOfMap ParticleSlam::present_piece(const Pose2& here) const {
  PieceOfMap piece{forgotten_.whole().about(here.translation()), drift_};
  piece.doubt.covariance += 0.5 * world_covariance({here, predicted_covariance()});
  return piece;
}

/// At the end of a step.
void ParticleSlam::watch_for_loop(std::span<const Observation> observations) {
  if (observations.empty()) return;
  const PieceOfMap in_view{forgotten_.whole(), drift_, loop_.next_station()};
  std::optional<Pose2> about_here;   // the best particle's will do for what fits
  std::optional<PoseEstimate> here;  // takes a look at all particles: where something is rejected
  std::optional<MapDoubt> returned_to;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const Decision decision = report_.observations[i].decision;
    const LandmarkId landmark =
        decision == Decision::invalid ? kUnknownLandmark : map_.find(observations[i].landmark);
    if (landmark < 0) continue;
    const PieceOfMap old = map_.seen_in(landmark);
    if (decision != Decision::rejected) map_.set_seen_in(landmark, in_view);
    if (decision == Decision::matched) loop_.still_matched(landmark);
    if (decision == Decision::created || !loop_.is_old(old)) continue;
    const bool fits = decision == Decision::matched;
    if (fits && !about_here) about_here = poses_.at(best_particle()) * pending_.mean;
    if (!fits && !here) here = estimate();
    const Pose2& from = fits ? *about_here : here->pose;
    const SightedLandmark seen = sighted_landmark(from, sensor_.body_from_sensor, observations[i]);
    SeenAgain again{
        .landmark = landmark, .seen = seen.in_world, .seen_in = old, .seen_from = from.translation()};
    again.seen_covariance = seen.by_reading * reading_covariance(sensor_) * seen.by_reading.transpose();
    if (fits) {
      loop_.matched(again, present_piece(from));
      if (!returned_to || is_less(*returned_to, old.doubt, from)) returned_to = old.doubt;
    } else {
      const ParticleMap::Mean mapped = map_.mean(landmark, weights_, ancestry_);
      again.mapped = mapped.position;
      again.mapped_covariance = mapped.within + mapped.scatter;
      loop_.rejected(again, present_piece(from));
    }
  }
  std::optional<MapBend> found;
  if (loop_.has_news() && !map_.has_nameless())  // which would have to be looked for elsewhere then
    found = loop_.close(present_piece(here->pose));
  if (found) {
    bend(*found, here->pose);
    forgotten_.remember(found->old_doubt(), found->doubt_after(drift_));
    report_.closed_loop = true;
  } else if (returned_to && loop_.has_closed() && is_less(forgotten_.whole(), *returned_to, *about_here)) {
    forgotten_.remember(*returned_to, *returned_to);
  }
}

/// Eq. 65: every particle's present piece comes to lie where the sightings say, within what they leave open.
/// What particles have in common with it follows, those of old for whom has descended from them: eq. 66.
void ParticleSlam::bend(const MapBend& bend, const Pose2& here) {
  predict(poses_, systematic_, pending_, all(), predicted_);
  draw_normals(next_draw(), all(), n_);
  const Matrix3 L = semidefinite_root(bend.move().covariance);
  std::vector<Vector3> twists;
  for (std::size_t i = 0; i < all().last; ++i) {
    const Pose2 there = bend.motion(bend.move().twist + L * n_.at(i)) * here;
    twists.push_back(bend.twist(there * predicted_.at(i).inverse()));
    poses_.set(i, bend.motion(twists.back()) * poses_.at(i));
  }
  const Twists of_particles({twists.data(), options_.particles});
  map_.bend(bend, of_particles, ancestry_);
  if (options_.keep_paths) paths_.bend(bend, of_particles, ancestry_);
}

}  // namespace trundle
