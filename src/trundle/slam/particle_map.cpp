#include "trundle/slam/particle_map.hpp"

#include <numeric>

#include "trundle/slam/landmark_kernels.hpp"
#include "trundle/slam/pieces.hpp"

namespace trundle {

ParticleMap::ParticleMap(std::size_t particles, Precision precision, std::size_t threads)
    : particles_(particles), precision_(precision), threads_(threads), spare_(particles, precision) {
  way_.ancestors.resize(padded(particles));
  std::iota(way_.ancestors.begin(), way_.ancestors.end(), Ancestry::Index{0});  // what pads keeps to itself
}

LandmarkId ParticleMap::find(LandmarkId id) const {
  const auto i = static_cast<std::size_t>(id);
  return i < index_of_.size() ? index_of_[i] : kUnknownLandmark;
}

LandmarkId ParticleMap::add(LandmarkId id, const Vector2& origin, Ancestry& ancestry) {
  const auto landmark = static_cast<LandmarkId>(entries_.size());
  entries_.push_back({id, ancestry.now(), LandmarkColumns(particles_, precision_, origin), 1});
  ancestry.hold(ancestry.now());
  const auto i = static_cast<std::size_t>(id);
  if (index_of_.size() <= i) index_of_.resize(i + 1, kUnknownLandmark);
  index_of_[i] = landmark;
  return landmark;
}

void ParticleMap::gather(Entry& entry, const Ancestry& ancestry) {
  if (way_.from != entry.epoch || way_.to != ancestry.now()) {
    ancestry.write_ancestors(entry.epoch, way_.ancestors);
    way_.from = entry.epoch;
    way_.to = ancestry.now();
  }
  for_all_particles(particles_, threads_, [&](ParticleRange piece) {
    gather_landmark(entry.columns, way_.ancestors, piece, spare_);
  });
  entry.columns.swap_numbers(spare_);
}

LandmarkColumns& ParticleMap::current(LandmarkId landmark, Ancestry& ancestry) {
  Entry& entry = entries_[static_cast<std::size_t>(landmark)];
  if (entry.epoch == ancestry.now()) return entry.columns;
  gather(entry, ancestry);
  ancestry.hold(ancestry.now());
  ancestry.release(entry.epoch);
  entry.epoch = ancestry.now();
  return entry.columns;
}

MappedLandmark ParticleMap::mixture(LandmarkId landmark, std::span<const double> weights,
                                    const Ancestry& ancestry) const {
  const Entry& entry = entries_[static_cast<std::size_t>(landmark)];
  const auto estimate_of = [&](std::size_t particle) {
    return entry.columns.at(ancestry.ancestor(entry.epoch, static_cast<Ancestry::Index>(particle)));
  };
  MappedLandmark result{entry.id, Vector2::Zero(), Matrix2::Zero(), entry.sightings};
  for (std::size_t i = 0; i < particles_; ++i) {
    const LandmarkEstimate m = estimate_of(i);
    result.position += weights[i] * Vector2(m.x, m.y);
  }
  for (std::size_t i = 0; i < particles_; ++i) {
    const LandmarkEstimate m = estimate_of(i);
    const Vector2 apart = Vector2(m.x, m.y) - result.position;
    const Matrix2 within = (Matrix2() << m.xx, m.xy, m.xy, m.yy).finished();
    result.covariance += weights[i] * (within + apart * apart.transpose());
  }
  return result;
}

}  // namespace trundle
