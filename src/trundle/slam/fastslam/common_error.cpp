#include "trundle/slam/fastslam/common_error.hpp"

#include <algorithm>
#include <iterator>

#include <Eigen/Cholesky>

#include "trundle/slam/cholesky.hpp"

namespace trundle::slam {
namespace {

/// Of a body's place.
bool is_less(const FrameCovariance& one, const FrameCovariance& other, const Pose2& pose) {
  const auto variance = [&](const FrameCovariance& frame) {
    return frame.about(pose.translation()).covariance.topLeftCorner<2, 2>().trace();
  };
  return variance(one) < variance(other);
}

/// Eq. 61a: what particles differed in of their systematic errors is lost with their ancestors too, and their
/// mean has wandered off by as much. It becomes what each of them does not know.
void inflate_systematic(double share_lost, ParticleBelief& belief) {
  if (belief.pending.systematic() == 0 || share_lost <= 0.0 || share_lost >= 1.0) return;
  const ParticleSet& particles = belief.particles;
  const auto count = static_cast<double>(particles.count);
  Systematic mean = Systematic::Zero(belief.pending.systematic());
  for (std::size_t i = 0; i < particles.count; ++i) mean += particles.systematic.at(i) / count;
  SystematicCovariance scatter = SystematicCovariance::Zero(mean.size(), mean.size());
  for (std::size_t i = 0; i < particles.count; ++i) {
    const Systematic apart = particles.systematic.at(i) - mean;
    scatter += apart * apart.transpose() / count;
  }
  belief.pending.widen(2.0 * share_lost / (1.0 - share_lost) * scatter);
}

}  // namespace

CommonError::CommonError(const LandmarkSensor& sensor, std::size_t particles)
    : sensor_(sensor), coalescence_(particles) {}

PoseEstimate CommonError::estimate(const ParticleBelief& belief) const {
  PoseEstimate estimate = mean_of(belief.particles, belief.pending);
  estimate.covariance += lost_.beyond_scatter(estimate.pose.translation());
  return estimate;
}

void CommonError::predict(const Motion& motion, const ParticleBelief& belief) {
  const Pose2 here = belief.near();
  drift_ = drift_.about(here.translation());
  drift_.covariance += world_covariance({here, motion.covariance});
}

void CommonError::add_sightings(std::span<const MatchedSighting> matched, const StepReport& report,
                                ParticleBelief& belief) {
  if (!report.observations.empty()) loop_.next_keyframe();
  find_revisits(matched, belief);
  inflate_if_few(matched.size(), report, belief);
}

void CommonError::find_revisits(std::span<const MatchedSighting> matched, ParticleBelief& belief) {
  revisited_.clear();
  for (const MatchedSighting& s : matched) {
    const Submap& seen_in = belief.map.seen_in(s.landmark);
    if (!loop_.is_old(seen_in)) continue;
    const ParticleMap::Inherited all = belief.map.inherited(s.landmark, belief.particles.ancestry);
    revisited_.push_back(
        {s.observation, s.landmark, seen_in, all.columns.at(all.from[belief.particles.best()])});
  }
}

/// Eq. 70: what fits where most is rejected may do so by chance. All that the motion may have erred by is
/// still open.
void CommonError::inflate_if_few(std::size_t matched, const StepReport& report,
                                 const ParticleBelief& belief) {
  // With the gate of 99.9 % a consistent filter rejects one in a thousand; two thirds are no chance.
  constexpr std::size_t kRejectedForEach = 2;
  const auto rejected = static_cast<std::size_t>(
      std::ranges::count(report.observations, Decision::rejected, &ObservationReport::decision));
  if (matched == 0 || rejected <= kRejectedForEach * matched) return;
  const Pose2 here = belief.here();
  lost_.inflate({here.translation(), 0.5 * world_covariance({here, belief.predicted_covariance()})});
}

void CommonError::before_resampling(ParticleBelief& belief) {
  coalescence_.hold(belief.particles.ancestry);
}

void CommonError::after_resampling(const StepReport& report, ParticleBelief& belief) {
  Ancestry& ancestry = belief.particles.ancestry;
  const double share = coalescence_.share_lost(ancestry);
  inflate_systematic(share, belief);
  std::vector<LandmarkId> in_view;
  std::vector<std::vector<Vector2>> places;
  for (const ObservationReport& seen : report.observations) {
    const LandmarkId landmark =
        seen.decision == Decision::matched ? belief.map.number_of(seen.landmark) : kUnknownLandmark;
    if (landmark < 0) continue;
    in_view.push_back(landmark);
    if (places.size() == kLandmarksOfScatter) continue;
    const ParticleMap::Inherited inherited = belief.map.inherited(landmark, ancestry);
    std::vector<Vector2> of_particles =
        some_places(inherited.columns, inherited.from, belief.particles.count);
    if (!of_particles.empty()) places.push_back(std::move(of_particles));
  }
  const std::optional<FrameCovariance> left = map_scatter(places);
  if (!left) return;
  const FrameCovariance total = lost_.after_resampling(*left, share);
  for (const LandmarkId landmark : in_view) belief.map.set_frame(landmark, total);
}

/// The map where the robot is, with what the motion since it was last looked at may have erred by.
Submap CommonError::present_submap(const Pose2& here, const ParticleBelief& belief) const {
  Submap submap{lost_.total().about(here.translation()), drift_};
  submap.frame.covariance += 0.5 * world_covariance({here, belief.predicted_covariance()});
  return submap;
}

/// By a robot at `from`, if the map has it there.
Revisit CommonError::revisit_of(LandmarkId landmark, const Observation& observation, const Pose2& from,
                                const ParticleMap& map) const {
  const SightedLandmark seen = sighted_landmark(from, sensor_.body_from_sensor, observation);
  return {.landmark = landmark,
          .seen = seen.in_world,
          .seen_covariance = seen.spread(reading_covariance(sensor_)),
          .seen_in = map.seen_in(landmark),
          .seen_from = from.translation()};
}

std::optional<CommonError::ClosedLoop> CommonError::close_loop(std::span<const Observation> observations,
                                                               const StepReport& report,
                                                               ParticleBelief& belief) {
  if (observations.empty()) return std::nullopt;
  ParticleMap& map = belief.map;
  std::optional<PoseEstimate> here;  // takes a look at all particles: where something is rejected
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const Decision decision = report.observations[i].decision;
    const LandmarkId landmark =
        decision == Decision::invalid ? kUnknownLandmark : map.find(observations[i].landmark);
    if (landmark < 0) continue;
    if (decision == Decision::matched) loop_.still_matched(landmark);
    if (decision != Decision::rejected) {
      map.set_seen_in(landmark, {lost_.total(), drift_, loop_.keyframe()});
    } else if (loop_.is_old(map.seen_in(landmark))) {
      if (!here) here = estimate(belief);
      Revisit revisit = revisit_of(landmark, observations[i], here->pose, map);
      const ParticleMap::Mean mapped =
          map.mean(landmark, belief.particles.weights, belief.particles.ancestry);
      revisit.mapped = mapped.position;
      revisit.mapped_covariance = mapped.within + mapped.scatter;
      loop_.add_rejected(revisit, present_submap(here->pose, belief));
    }
  }
  update_from_revisits(observations, belief);
  if (!loop_.has_evidence() || map.has_unidentified())
    return std::nullopt;  // those would have to be looked for then
  const std::optional<LoopCorrection> found = loop_.close(present_submap(here->pose, belief));
  if (!found) return std::nullopt;
  lost_.reset(found->old_frame(), found->frame_after(drift_));
  return ClosedLoop{*found, here->pose};
}

/// Old landmarks that fit show where the present submap lies, and how well that is known: as well as the most
/// certain of their submaps. The most probable particle will do for the robot.
void CommonError::update_from_revisits(std::span<const Observation> observations,
                                       const ParticleBelief& belief) {
  if (revisited_.empty()) return;
  const Pose2 here = belief.here();
  const Submap now = present_submap(here, belief);
  std::vector<Revisit> revisits;
  for (const MatchedRevisit& r : revisited_) {
    revisits.push_back(revisit_of(r.landmark, observations[r.observation], here, belief.map));
    revisits.back().seen_in = r.seen_in;
    revisits.back().mapped = {r.mapped.x, r.mapped.y};
    revisits.back().mapped_covariance << r.mapped.xx, r.mapped.xy, r.mapped.xy, r.mapped.yy;
    loop_.add_matched(revisits.back(), now);
  }
  if (loop_.is_closed())
    for (const Revisit& s : revisits)
      lost_.update(s.seen_in.frame, {s.seen, s.mapped - s.seen, s.mapped_covariance + s.seen_covariance});
  const auto most_certain = std::ranges::min_element(revisits, [&](const Revisit& one, const Revisit& other) {
    return is_less(one.seen_in.frame, other.seen_in.frame, here);
  });
  lost_.inflate_to(most_certain->seen_in.frame, here.translation());
}

void correct_loop(const CommonError::ClosedLoop& closed, const Draw& draw, ParticleBelief& belief) {
  const auto& [correction, here] = closed;
  ParticleSet& particles = belief.particles;
  predict(particles.poses, particles.systematic, belief.pending.prediction(), particles.all(),
          particles.predicted);
  draw_normals(draw, particles.all(), particles.noise);
  const Matrix3 L = semidefinite_root(correction.move().covariance);
  std::vector<Vector3> twists;
  for (std::size_t i = 0; i < particles.all().last; ++i) {
    const Pose2 there = correction.motion(correction.move().twist + L * particles.noise.at(i)) * here;
    twists.push_back(correction.twist(there * particles.predicted.at(i).inverse()));
    particles.poses.set(i, correction.motion(twists.back()) * particles.poses.at(i));
  }
  const Twists of_particles({twists.data(), particles.count});
  belief.map.correct(correction, of_particles, particles.ancestry);
  if (belief.keeps_paths) belief.paths.correct(correction, of_particles, particles.ancestry);
}

}  // namespace trundle::slam
