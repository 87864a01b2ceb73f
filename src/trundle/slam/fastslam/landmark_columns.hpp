#pragma once

#include <algorithm>
#include <array>

#include "trundle/slam/fastslam/columns.hpp"
#include "trundle/slam/fastslam/particle_landmark.hpp"
#include "trundle/slam/fastslam/particle_options.hpp"

namespace trundle::slam {

/// In the column of a landmark that a particle does not have; no variance is negative.
inline constexpr double kAbsent = -1.0;
[[nodiscard]] inline bool is_there(const LandmarkEstimate& m) {
  return m.xx >= 0.0;
}

/// One landmark in the maps of all particles: x, y, xx, xy, yy, each a column by particle.
class LandmarkColumns {
 public:
  static constexpr std::size_t kColumns = 5;

  LandmarkColumns() : LandmarkColumns(0, Precision::float32) {}
  LandmarkColumns(std::size_t particles, Precision precision, const Vector2& origin = Vector2::Zero())
      : stride_(padded(particles)),
        origin_(origin),
        single_(precision == Precision::float32 ? kColumns * stride_ : 0),
        double_(precision == Precision::float32 ? 0 : kColumns * stride_) {}

  [[nodiscard]] Precision precision() const {
    return double_.empty() ? Precision::float32 : Precision::float64;
  }
  /// Where x and y are counted from.
  [[nodiscard]] const Vector2& origin() const { return origin_; }
  void count_from(const Vector2& origin) { origin_ = origin; }
  [[nodiscard]] std::size_t stride() const { return stride_; }
  /// The columns, one after the other, each `stride` long. Real is that of the precision.
  template <class Real>
  Real* numbers() {
    if constexpr (sizeof(Real) == sizeof(float))
      return single_.data();
    else
      return double_.data();
  }

  template <class Real>
  [[nodiscard]] const Real* numbers() const {
    return const_cast<LandmarkColumns*>(this)->numbers<Real>();
  }
  /// Hands its numbers to another and takes the room of those that the other had; the origin of both is its.
  void move_to(LandmarkColumns& other) {
    single_.swap(other.single_);
    double_.swap(other.double_);
    other.origin_ = origin_;
  }

  /// The same landmark for all particles.
  void fill(const LandmarkEstimate& m) {
    origin_ = {m.x, m.y};
    const std::array<double, kColumns> numbers = {0.0, 0.0, m.xx, m.xy, m.yy};
    for (std::size_t k = 0; k < kColumns; ++k)
      if (double_.empty())
        std::fill_n(single_.data() + k * stride_, stride_, static_cast<float>(numbers[k]));
      else
        std::fill_n(double_.data() + k * stride_, stride_, numbers[k]);
  }
  /// In the world.
  [[nodiscard]] LandmarkEstimate at(std::size_t particle) const {
    const auto number = [&](std::size_t k) {
      const std::size_t i = k * stride_ + particle;
      return double_.empty() ? static_cast<double>(single_[i]) : double_[i];
    };
    return {origin_.x() + number(0), origin_.y() + number(1), number(2), number(3), number(4)};
  }
  void set(std::size_t particle, const LandmarkEstimate& m) {
    const auto put = [&](std::size_t k, double x) {
      const std::size_t i = k * stride_ + particle;
      if (double_.empty())
        single_[i] = static_cast<float>(x);
      else
        double_[i] = x;
    };
    put(0, m.x - origin_.x());
    put(1, m.y - origin_.y());
    put(2, m.xx);
    put(3, m.xy);
    put(4, m.yy);
  }

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.stride_, self.origin_, self.single_, self.double_);
  }

 private:
  std::size_t stride_;
  Vector2 origin_;
  Column<float> single_;
  Column<double> double_;
};

}  // namespace trundle::slam
