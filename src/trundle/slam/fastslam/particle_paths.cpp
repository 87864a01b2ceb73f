#include "trundle/slam/fastslam/particle_paths.hpp"

#include <algorithm>
#include <numeric>

#include <Eigen/Cholesky>

namespace trundle::slam {

const Pose2& ParticlePaths::Segment::at(std::size_t keyframe, Ancestry::Index particle) const {
  const auto column = std::ranges::lower_bound(particles, particle) - particles.begin();
  return poses[keyframe * particles.size() + static_cast<std::size_t>(column)];
}

void ParticlePaths::Segment::keep(std::span<const Ancestry::Run> survivors) {
  std::vector<Pose2> kept;
  kept.reserve(keyframes() * survivors.size());
  for (std::size_t keyframe = 0; keyframe < keyframes(); ++keyframe)
    for (const Ancestry::Run& run : survivors) kept.push_back(at(keyframe, run.ancestor));
  poses = std::move(kept);
  particles.clear();
  for (const Ancestry::Run& run : survivors) particles.push_back(run.ancestor);
}

void ParticlePaths::add(const Motion& motion) {
  if (!keeps_) return;
  since_keyframe_ = since_keyframe_ * motion;
  steps_.push_back({since_keyframe_});
}

void ParticlePaths::add_keyframe(const PoseColumns& poses, Ancestry& ancestry) {
  if (!keeps_) return;
  steps_.back().is_keyframe = true;
  since_keyframe_ = {};
  if (segments_.empty() || segments_.back().epoch != ancestry.now()) {
    Segment& segment = segments_.emplace_back();
    segment.epoch = ancestry.now();
    segment.particles.resize(ancestry.particles());
    std::iota(segment.particles.begin(), segment.particles.end(), Ancestry::Index{0});
    ancestry.hold(segment.epoch);
  }
  for (std::size_t i = 0; i < ancestry.particles(); ++i) segments_.back().poses.push_back(poses.at(i));
}

void ParticlePaths::resampled(Ancestry& ancestry) {
  for (auto segment = segments_.rbegin(); segment != segments_.rend(); ++segment) {
    const auto survivors = ancestry.runs(segment->epoch);
    if (4 * survivors.size() <= 3 * segment->particles.size()) segment->keep(survivors);
  }
  while (!segments_.empty() && ancestry.survivors(segments_.front().epoch) == 1) {
    Segment& oldest = segments_.front();
    const Ancestry::Index ancestor = ancestry.ancestor(oldest.epoch, 0);
    for (std::size_t keyframe = 0; keyframe < oldest.keyframes(); ++keyframe)
      common_.push_back(oldest.at(keyframe, ancestor));
    ancestry.release(oldest.epoch);
    segments_.pop_front();
  }
}

std::vector<Pose2> ParticlePaths::keyframes_of(Ancestry::Index particle, const Ancestry& ancestry) const {
  std::vector<Pose2> keyframes = common_;
  for (const Segment& segment : segments_) {
    const Ancestry::Index ancestor = ancestry.ancestor(segment.epoch, particle);
    for (std::size_t keyframe = 0; keyframe < segment.keyframes(); ++keyframe)
      keyframes.push_back(segment.at(keyframe, ancestor));
  }
  return keyframes;
}

std::vector<Pose2> ParticlePaths::path_of(const Query& query, const Ancestry& ancestry) const {
  const Systematic& s = query.systematic;
  std::vector<Pose2> path;
  path.reserve(steps_.size());
  Pose2 before = query.start;
  const auto append = [&](const Motion& motion, const Vector3& error) {
    path.push_back(before * motion.mean * exp(Twist2::from(motion.by_first(s.size()) * s + error)));
  };
  for (const Pose2& keyframe : keyframes_of(query.particle, ancestry)) {
    std::size_t last = path.size();
    while (!steps_[last].is_keyframe) ++last;
    const Motion& all = steps_[last].since_keyframe;
    const Vector3 error = log((before * all.mean).inverse() * keyframe).vector() - all.by_first(s.size()) * s;
    const Vector3 share = all.covariance.ldlt().solve(error);
    while (path.size() < last) {
      const Motion& motion = steps_[path.size()].since_keyframe;
      const Matrix3 Ad = adjoint(all.mean.inverse() * motion.mean);
      append(motion, motion.covariance * Ad.transpose() * share);
    }
    path.push_back(keyframe);
    before = keyframe;
  }
  while (path.size() < steps_.size()) append(steps_[path.size()].since_keyframe, Vector3::Zero());
  return path;
}

std::size_t ParticlePaths::ancestors(std::size_t keyframes_back, const Ancestry& ancestry) const {
  for (auto segment = segments_.rbegin(); segment != segments_.rend(); ++segment) {
    if (keyframes_back < segment->keyframes()) return ancestry.survivors(segment->epoch);
    keyframes_back -= segment->keyframes();
  }
  return 1;
}

std::size_t ParticlePaths::stored() const {
  return std::accumulate(segments_.begin(), segments_.end(), common_.size(),
                         [](std::size_t sum, const Segment& s) { return sum + s.poses.size(); });
}

}  // namespace trundle::slam
