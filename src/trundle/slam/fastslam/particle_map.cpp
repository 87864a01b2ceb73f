#include "trundle/slam/fastslam/particle_map.hpp"

#include <algorithm>
#include <numeric>

#include "trundle/slam/fastslam/landmark_kernels.hpp"
#include "trundle/slam/nth.hpp"

namespace trundle::slam {

ParticleMap::ParticleMap(std::size_t particles, LandmarkId first_unidentified)
    : particles_(particles), next_unidentified_(first_unidentified) {}

LandmarkId ParticleMap::find(LandmarkId name) const {
  const auto i = nth(name);
  return i < named_.size() ? named_[i] : kUnknownLandmark;
}

/// One without a name that has this number gets another.
LandmarkId ParticleMap::add(LandmarkId name, const Vector2& origin, Ancestry& ancestry) {
  next_unidentified_ = std::max(next_unidentified_, name + 1);
  if (const auto unidentified = unidentified_.extract(name)) number_unidentified(unidentified.mapped());
  const LandmarkId landmark = occupy(origin, ancestry);
  entries_[nth(landmark)].id = name;
  const auto i = nth(name);
  if (named_.size() <= i) named_.resize(i + 1, kUnknownLandmark);
  named_[i] = landmark;
  return landmark;
}

LandmarkId ParticleMap::add_unidentified(const Vector2& origin, Ancestry& ancestry) {
  const LandmarkId landmark = occupy(origin, ancestry);
  number_unidentified(landmark);
  return landmark;
}

void ParticleMap::number_unidentified(LandmarkId landmark) {
  entries_[nth(landmark)].id = next_unidentified_;
  unidentified_[next_unidentified_++] = landmark;
}

LandmarkId ParticleMap::occupy(const Vector2& origin, Ancestry& ancestry) {
  ancestry.hold(ancestry.now());
  if (removed_.empty()) {
    entries_.push_back({kUnknownLandmark, ancestry.now(), LandmarkColumns(particles_, origin), 1});
    return static_cast<LandmarkId>(entries_.size() - 1);
  }
  const LandmarkId landmark = removed_.back();
  removed_.pop_back();
  Entry& entry = entries_[nth(landmark)];
  entry = {kUnknownLandmark, ancestry.now(), std::move(entry.columns), 1};
  entry.columns.count_from(origin);
  return landmark;
}

/// Which of the maps.
std::size_t ParticleMap::ancestor_map_from(Ancestry::Epoch epoch, const Ancestry& ancestry) {
  if (ancestor_maps_to_ != ancestry.now() || (ancestor_maps_known_ >= kMostAtATime && pending_.empty()))
    ancestor_maps_known_ = 0;
  ancestor_maps_to_ = ancestry.now();
  for (std::size_t k = 0; k < ancestor_maps_known_; ++k)
    if (ancestor_maps_[k].from == epoch) return k;
  if (ancestor_maps_.size() == ancestor_maps_known_) {
    Column<Ancestry::Index> ancestors(padded(particles_));
    std::iota(ancestors.begin(), ancestors.end(), Ancestry::Index{0});  // what pads keeps to itself
    ancestor_maps_.push_back({epoch, std::move(ancestors)});
  }
  ancestor_maps_[ancestor_maps_known_].from = epoch;
  ancestry.write_ancestors(epoch, ancestor_maps_[ancestor_maps_known_].ancestors);
  return ancestor_maps_known_++;
}

ParticleMap::Stored ParticleMap::stored(LandmarkId landmark, const Ancestry& ancestry) {
  const auto pending = std::ranges::find(pending_, landmark, &PendingGather::landmark);
  if (pending != pending_.end())
    return {before_[nth(pending - pending_.begin())], ancestor_maps_[pending->ancestor_map].ancestors};
  const Entry& entry = entries_[nth(landmark)];
  return {entry.columns, ancestor_maps_[ancestor_map_from(entry.epoch, ancestry)].ancestors};
}

LandmarkColumns& ParticleMap::request(LandmarkId landmark, Ancestry& ancestry) {
  Entry& entry = entries_[nth(landmark)];
  if (entry.epoch == ancestry.now()) return entry.columns;
  if (pending_.size() == kMostAtATime) {
    gather({0, padded(particles_)});
    end_gather();
  }
  if (before_.size() == pending_.size()) before_.emplace_back(particles_);
  entry.columns.move_to(before_[pending_.size()]);
  pending_.push_back({landmark, ancestor_map_from(entry.epoch, ancestry)});
  ancestry.hold(ancestry.now());
  ancestry.release(entry.epoch);
  entry.epoch = ancestry.now();
  return entry.columns;
}

void ParticleMap::gather(ParticleRange range) {
  for (std::size_t k = 0; k < pending_.size(); ++k)
    gather_landmark(before_[k], ancestor_maps_[pending_[k].ancestor_map].ancestors, range,
                    entries_[nth(pending_[k].landmark)].columns);
}

LandmarkColumns& ParticleMap::current(LandmarkId landmark, Ancestry& ancestry) {
  LandmarkColumns& columns = request(landmark, ancestry);
  gather({0, padded(particles_)});
  end_gather();
  return columns;
}

void ParticleMap::remove(LandmarkId landmark, Ancestry& ancestry) {
  Entry& entry = entries_[nth(landmark)];
  ancestry.release(entry.epoch);
  unidentified_.erase(entry.id);
  entry.is_there = false;
  entry.sightings = 0;
  removed_.push_back(landmark);
}

bool ParticleMap::has(LandmarkId landmark, std::size_t particle, const Ancestry& ancestry) const {
  const Entry& entry = entries_[nth(landmark)];
  return entry.is_there &&
         is_there(entry.columns.at(ancestry.ancestor(entry.epoch, static_cast<Ancestry::Index>(particle))));
}

MappedLandmark ParticleMap::mixture(LandmarkId landmark, std::span<const double> weights,
                                    const Ancestry& ancestry) const {
  const Entry& entry = entries_[nth(landmark)];
  MappedLandmark result{entry.id, Vector2::Zero(), Matrix2::Zero(), entry.sightings};
  if (!entry.is_there) return result;
  const auto estimate_of = [&](std::size_t particle) {
    return entry.columns.at(ancestry.ancestor(entry.epoch, static_cast<Ancestry::Index>(particle)));
  };
  double share = 1.0;  // of the weight, that has it
  for (std::size_t i = 0; i < particles_; ++i) {
    const LandmarkEstimate m = estimate_of(i);
    if (is_there(m))
      result.position += weights[i] * Vector2(m.x, m.y);
    else
      share -= weights[i];
  }
  share = std::max(share, 1e-12);
  result.position /= share;
  for (std::size_t i = 0; i < particles_; ++i) {
    const LandmarkEstimate m = estimate_of(i);
    if (!is_there(m)) continue;
    const Vector2 apart = Vector2(m.x, m.y) - result.position;
    const Matrix2 own = (Matrix2() << m.xx, m.xy, m.xy, m.yy).finished();
    result.covariance += weights[i] / share * (own + apart * apart.transpose());
  }
  return result;
}

}  // namespace trundle::slam
