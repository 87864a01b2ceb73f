// What particles know: their estimates, with what they have forgotten, and loops closed in spite of that.
#include <algorithm>
#include <iterator>

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

PoseEstimate ParticleSlam::estimate() const {
  PoseEstimate estimate = mean_estimate();
  if (options_.estimate == PointEstimate::mean) return estimate;
  PoseColumns best(1);
  SystematicColumns systematic(1, pending_.systematic());
  best.set(0, poses_.at(leading_));
  systematic.set(0, systematic_.at(leading_));
  predict(best, systematic, pending_.prediction(), {0, padded(1)}, best);
  const Pose2 pose = best.at(0);
  const Vector3 apart(pose.x - estimate.pose.x, pose.y - estimate.pose.y,
                      wrap_angle(pose.heading - estimate.pose.heading));
  estimate.pose = pose;
  estimate.covariance += apart * apart.transpose();
  return estimate;
}

/// Headings are averaged as differences to the best particle's.
PoseEstimate ParticleSlam::mean_estimate() const {
  PoseColumns now(options_.particles);
  predict(poses_, systematic_, pending_.prediction(), all(), now);
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
  for (std::size_t i = 0; i < options_.particles; ++i) {
    const Vector3 apart = numbers_of(i) - mean;
    estimate.covariance += weights_[i] * apart * apart.transpose();
  }
  estimate.covariance += forgotten_.beyond_scatter(estimate.pose.translation());
  add_systematic(estimate);
  return estimate;
}

/// Mean and covariance of the mixture, as of the poses.
void ParticleSlam::add_systematic(PoseEstimate& estimate) const {
  estimate.systematic = Systematic::Zero(pending_.systematic());
  estimate.systematic_covariance = pending_.systematic_covariance();
  if (pending_.systematic() == 0) return;
  const auto of = [&](std::size_t i) { return pending_.systematic_of(systematic_.at(i)); };
  for (std::size_t i = 0; i < options_.particles; ++i) estimate.systematic += weights_[i] * of(i);
  for (std::size_t i = 0; i < options_.particles; ++i) {
    const Systematic apart = of(i) - estimate.systematic;
    estimate.systematic_covariance += weights_[i] * apart * apart.transpose();
  }
}

MappedLandmark ParticleSlam::landmark(std::size_t index) const {
  return map_.mixture(static_cast<LandmarkId>(index), weights_, ancestry_, forgotten_);
}

/// Eq. 61a: what particles differed in of their systematic errors is lost with their ancestors too, and their
/// mean has wandered off by as much. It becomes what each of them does not know.
void ParticleSlam::keep_systematic(double share_lost) {
  if (pending_.systematic() == 0 || share_lost <= 0.0 || share_lost >= 1.0) return;
  const auto count = static_cast<double>(options_.particles);
  Systematic mean = Systematic::Zero(pending_.systematic());
  for (std::size_t i = 0; i < options_.particles; ++i) mean += systematic_.at(i) / count;
  SystematicCovariance scatter = SystematicCovariance::Zero(mean.size(), mean.size());
  for (std::size_t i = 0; i < options_.particles; ++i) {
    const Systematic apart = systematic_.at(i) - mean;
    scatter += apart * apart.transpose() / count;
  }
  pending_.widen(2.0 * share_lost / (1.0 - share_lost) * scatter);
}

/// Eq. 61, after a resampling.
void ParticleSlam::keep_doubt() {
  const double share = kinship_.share_lost(ancestry_);
  keep_systematic(share);
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

/// Before this step improves them.
void ParticleSlam::note_returns() {
  returned_.clear();
  for (const Seen& s : seen_) {
    const PieceOfMap& seen_in = map_.seen_in(s.landmark);
    if (!loop_.is_old(seen_in)) continue;
    const ParticleMap::Inherited all = map_.inherited(s.landmark, ancestry_);
    returned_.push_back({s.observation, s.landmark, seen_in, all.columns.at(all.from[best_particle()])});
  }
}

/// Eq. 70: what fits where most is rejected may do so by chance. All that the motion may have erred by is
/// still open.
void ParticleSlam::distrust_few() {
  constexpr auto kRejectedForEach = 2;
  const auto rejected =
      std::ranges::count(report_.observations, Decision::rejected, &ObservationReport::decision);
  if (seen_.empty() || rejected <= kRejectedForEach * std::ssize(seen_)) return;
  const Pose2 here = poses_.at(best_particle()) * pending_.prediction().mean;
  forgotten_.keep({here.translation(), 0.5 * world_covariance({here, predicted_covariance()})});
}

/// By a robot at `from`, if the map has it there.
SeenAgain ParticleSlam::seen_again(LandmarkId landmark, const Observation& observation,
                                   const Pose2& from) const {
  const SightedLandmark seen = sighted_landmark(from, sensor_.body_from_sensor, observation);
  return {.landmark = landmark,
          .seen = seen.in_world,
          .seen_covariance = seen.spread(reading_covariance(sensor_)),
          .seen_in = map_.seen_in(landmark),
          .seen_from = from.translation()};
}

/// At the end of a step.
void ParticleSlam::watch_for_loop(std::span<const Observation> observations) {
  if (observations.empty()) return;
  std::optional<PoseEstimate> here;  // takes a look at all particles: where something is rejected
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const Decision decision = report_.observations[i].decision;
    const LandmarkId landmark =
        decision == Decision::invalid ? kUnknownLandmark : map_.find(observations[i].landmark);
    if (landmark < 0) continue;
    if (decision == Decision::matched) loop_.still_matched(landmark);
    if (decision != Decision::rejected) {
      map_.set_seen_in(landmark, {forgotten_.whole(), drift_, loop_.station()});
    } else if (loop_.is_old(map_.seen_in(landmark))) {
      if (!here) here = mean_estimate();
      SeenAgain again = seen_again(landmark, observations[i], here->pose);
      const ParticleMap::Mean mapped = map_.mean(landmark, weights_, ancestry_);
      again.mapped = mapped.position;
      again.mapped_covariance = mapped.within + mapped.scatter;
      loop_.rejected(again, present_piece(here->pose));
    }
  }
  recall(observations);
  if (!loop_.has_news() || map_.has_nameless()) return;  // which would have to be looked for elsewhere then
  const std::optional<MapBend> found = loop_.close(present_piece(here->pose));
  if (!found) return;
  bend(*found, here->pose);
  forgotten_.remember(found->old_doubt(), found->doubt_after(drift_));
  report_.closed_loop = true;
}

/// Landmarks of old that fit tell where the present piece lies, and how well that is known: as well as the
/// surest of theirs. The most probable particle will do for the robot.
void ParticleSlam::recall(std::span<const Observation> observations) {
  if (returned_.empty()) return;
  const Pose2 here = poses_.at(best_particle()) * pending_.prediction().mean;
  const PieceOfMap now = present_piece(here);
  std::vector<SeenAgain> back;
  for (const Returned& r : returned_) {
    back.push_back(seen_again(r.landmark, observations[r.observation], here));
    back.back().seen_in = r.seen_in;
    back.back().mapped = {r.mapped.x, r.mapped.y};
    back.back().mapped_covariance << r.mapped.xx, r.mapped.xy, r.mapped.xy, r.mapped.yy;
    loop_.matched(back.back(), now);
  }
  if (loop_.is_closed())
    for (const SeenAgain& s : back)
      forgotten_.recall(s.seen_in.doubt,
                        {s.seen, s.mapped - s.seen, s.mapped_covariance + s.seen_covariance});
  const auto surest = std::ranges::min_element(back, [&](const SeenAgain& one, const SeenAgain& other) {
    return is_less(one.seen_in.doubt, other.seen_in.doubt, here);
  });
  forgotten_.be_no_surer_than(surest->seen_in.doubt, here.translation());
}

/// Eq. 65: every particle's present piece comes to lie where the sightings say, within what they leave open.
/// What particles have in common with it follows, those of old for whom has descended from them: eq. 66.
void ParticleSlam::bend(const MapBend& bend, const Pose2& here) {
  predict(poses_, systematic_, pending_.prediction(), all(), predicted_);
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
