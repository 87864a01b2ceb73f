#pragma once

#include <algorithm>
#include <array>

#include "trundle/slam/fastslam/columns.hpp"
#include "trundle/slam/fastslam/particle_landmark.hpp"

namespace trundle::slam {

/// In the column of a landmark that a particle does not have; no variance is negative.
inline constexpr double kAbsent = -1.0;
[[nodiscard]] inline bool is_there(const LandmarkEstimate& m) {
  return m.xx >= 0.0;
}

/// One landmark in the maps of all particles: x, y, xx, xy, yy, each a column by particle. In single
/// precision: counted from a place near the landmark, x and y have micrometres wherever the robot is.
class LandmarkColumns {
 public:
  static constexpr std::size_t kColumns = 5;

  explicit LandmarkColumns(std::size_t particles = 0, const Vector2& origin = Vector2::Zero())
      : stride_(padded(particles)), origin_(origin), numbers_(kColumns * stride_) {}

  /// Where x and y are counted from.
  [[nodiscard]] const Vector2& origin() const { return origin_; }
  void count_from(const Vector2& origin) { origin_ = origin; }
  [[nodiscard]] std::size_t stride() const { return stride_; }
  /// The columns, one after the other, each `stride` long.
  float* numbers() { return numbers_.data(); }
  [[nodiscard]] const float* numbers() const { return numbers_.data(); }
  /// Hands its numbers to another and takes the room of those that the other had; the origin of both is its.
  void move_to(LandmarkColumns& other) {
    numbers_.swap(other.numbers_);
    other.origin_ = origin_;
  }

  /// The same landmark for all particles.
  void fill(const LandmarkEstimate& m) {
    origin_ = {m.x, m.y};
    const std::array<double, kColumns> numbers = {0.0, 0.0, m.xx, m.xy, m.yy};
    for (std::size_t k = 0; k < kColumns; ++k)
      std::fill_n(numbers_.data() + k * stride_, stride_, static_cast<float>(numbers[k]));
  }
  /// In the world.
  [[nodiscard]] LandmarkEstimate at(std::size_t particle) const {
    const auto number = [&](std::size_t k) { return static_cast<double>(numbers_[k * stride_ + particle]); };
    return {origin_.x() + number(0), origin_.y() + number(1), number(2), number(3), number(4)};
  }
  void set(std::size_t particle, const LandmarkEstimate& m) {
    const auto put = [&](std::size_t k, double x) {
      numbers_[k * stride_ + particle] = static_cast<float>(x);
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
    archive(self.stride_, self.origin_, self.numbers_);
  }

 private:
  std::size_t stride_;
  Vector2 origin_;
  Column<float> numbers_;
};

}  // namespace trundle::slam
