#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <new>
#include <span>
#include <vector>

#include "trundle/slam/fastslam/particle_landmark.hpp"
#include "trundle/slam/models/motion.hpp"

namespace trundle::slam {

/// Columns by particle are padded to whole groups of so many, so that kernels have no remainders. The padding
/// holds particles that nobody asks for: finite numbers, no weight.
inline constexpr std::size_t kParticleLanes = 16;
constexpr std::size_t padded(std::size_t particles) {
  return (particles + kParticleLanes - 1) / kParticleLanes * kParticleLanes;
}

/// Memory at the address of a cache line.
template <class T>
struct CacheAligned {
  using value_type = T;
  static constexpr std::align_val_t kLine{64};

  CacheAligned() = default;
  template <class U>
  explicit CacheAligned(const CacheAligned<U>&) {}
  T* allocate(std::size_t count) { return static_cast<T*>(::operator new(count * sizeof(T), kLine)); }
  void deallocate(T* memory, std::size_t) { ::operator delete(memory, kLine); }
  bool operator==(const CacheAligned&) const { return true; }
};

/// A number of every particle.
template <class T>
using Column = std::vector<T, CacheAligned<T>>;

/// A vector of every particle: a column for each of its numbers.
template <class Vector>
class VectorColumns {
 public:
  explicit VectorColumns(std::size_t particles, Eigen::Index count = Vector::RowsAtCompileTime)
      : columns_(static_cast<std::size_t>(count), Column<double>(padded(particles))) {
    assert(count >= 0);
  }
  [[nodiscard]] Eigen::Index count() const { return static_cast<Eigen::Index>(columns_.size()); }
  double* operator[](std::size_t k) { return columns_[k].data(); }
  const double* operator[](std::size_t k) const { return columns_[k].data(); }
  [[nodiscard]] Vector at(std::size_t particle) const {
    Vector v(count());
    for (std::size_t k = 0; k < columns_.size(); ++k) v[static_cast<Eigen::Index>(k)] = columns_[k][particle];
    return v;
  }
  void set(std::size_t particle, const Vector& v) {
    for (std::size_t k = 0; k < columns_.size(); ++k) columns_[k][particle] = v[static_cast<Eigen::Index>(k)];
  }
  /// What was parents[i]'s becomes i's. `spare` is a column of as many particles.
  void permute(std::span<const std::uint32_t> parents, Column<double>& spare) {
    const auto count = static_cast<std::ptrdiff_t>(parents.size());
    for (Column<double>& column : columns_) {
      for (std::size_t i = 0; i < parents.size(); ++i) spare[i] = column[parents[i]];
      std::copy(column.begin() + count, column.end(), spare.begin() + count);
      column.swap(spare);
    }
  }

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    for (auto& column : self.columns_) archive(column);
  }

 private:
  std::vector<Column<double>> columns_;
};

/// A twist, or n of docs/theory/fastslam.md, eq. 15.
using TripleColumns = VectorColumns<Vector3>;
/// The systematic errors.
using SystematicColumns = VectorColumns<Systematic>;

/// A pose of every particle: columns x, y, heading.
class PoseColumns {
 public:
  explicit PoseColumns(std::size_t particles) : numbers_(particles) {}
  double* operator[](std::size_t k) { return numbers_[k]; }
  const double* operator[](std::size_t k) const { return numbers_[k]; }
  [[nodiscard]] Pose2 at(std::size_t particle) const {
    return {numbers_[0][particle], numbers_[1][particle], numbers_[2][particle]};
  }
  void permute(std::span<const std::uint32_t> parents, Column<double>& spare) {
    numbers_.permute(parents, spare);
  }

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.numbers_);
  }
  void set(std::size_t particle, const Pose2& pose) {
    numbers_.set(particle, {pose.x, pose.y, pose.heading});
  }

 private:
  TripleColumns numbers_;
};

/// Where every particle's landmark sensor stands, from a place near them all, and where its bearing 0 points.
struct SensorColumns {
  explicit SensorColumns(std::size_t particles)
      : x(padded(particles)), y(padded(particles)), cos(padded(particles)), sin(padded(particles)) {}

  Vector2 origin = Vector2::Zero();
  Column<double> x, y, cos, sin;

  /// From the origin.
  [[nodiscard]] SensorAt at(std::size_t particle) const {
    return {x[particle], y[particle], cos[particle], sin[particle]};
  }
  [[nodiscard]] SensorAt in_world(std::size_t particle) const {
    return {origin.x() + x[particle], origin.y() + y[particle], cos[particle], sin[particle]};
  }
  void set(std::size_t particle, const SensorAt& from_origin) {
    x[particle] = from_origin.x;
    y[particle] = from_origin.y;
    cos[particle] = from_origin.cos;
    sin[particle] = from_origin.sin;
  }

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.origin, self.x, self.y, self.cos, self.sin);
  }
};

/// Particles from `first` to before `last`, both at whole groups of kParticleLanes.
struct ParticleRange {
  std::size_t first;
  std::size_t last;
};

}  // namespace trundle::slam
