#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "trundle/slam/models/motion.hpp"
#include "trundle/slam/models/observation.hpp"
#include "trundle/slam/report.hpp"

namespace trundle::slam {

/// A landmark as it was last seen, carried along with the robot's motion since.
struct SightedPoint {
  Vector2 in_body = Vector2::Zero();
  Matrix2 covariance = Matrix2::Zero();  ///< of the reading, and of the motion since
  LandmarkId landmark = kUnknownLandmark;
  std::uint64_t step = 0;               ///< when it was seen
  Vector2 seen_from = Vector2::Zero();  ///< where the robot was when it said something new, in today's frame
  /// Covariance with the odometry's systematic errors, of where it is taken to be less where it is.
  Eigen::Matrix<double, 2, Eigen::Dynamic, 0, 2, kMostSystematic> with_systematic{2, 0};

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.in_body, self.covariance, self.landmark, self.step, self.seen_from, self.with_systematic);
  }
};

/// Nothing distinguishes them: sightings of one landmark, or of neighbours, whose errors are the same.
[[nodiscard]] bool are_one_place(const SightedPoint& a, const SightedPoint& b);

/// What bounds a local map.
struct LocalMapOptions {
  std::size_t most_points = 24;  ///< the points seen last are kept: bounds the time of a step
  double largest_sigma_m = 1.0;  ///< a less certain point goes: half of what neighbouring landmarks lie apart
};

/// The landmarks seen lately, in today's body frame: what a robot that does not know where it is has to
/// recognise a place by. Bounded in number and uncertainty by its options.
/// docs/theory/global-localization.md, eq. 46.
class LocalMap {
 public:
  explicit LocalMap(const LandmarkSensor& sensor, const LocalMapOptions& options = {})
      : sensor_(sensor), options_(options) {}

  /// `systematic`: what is known of the odometry's systematic errors, which the motion's mean allows for.
  void step(const Motion& motion, std::span<const Observation> observations,
            const SystematicCovariance& systematic = {});
  /// What is read of the first systematic error, where `systematic` was known of them before.
  void read_bias(const BiasReading& reading, const Systematic& systematic,
                 const SystematicCovariance& covariance);
  /// Of each observation of the last step: 1 where it is new, 0 where it repeats what was seen from here.
  [[nodiscard]] std::span<const double> novelty() const { return novelty_; }
  /// What was seen before that step belongs to another place.
  void forget_before(std::uint64_t step);

  [[nodiscard]] std::span<const SightedPoint> points() const {
    return points_;
  }  ///< those seen last come last
  [[nodiscard]] std::uint64_t now() const { return now_; }

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.now_, self.points_, self.novelty_);
  }

 private:
  double add(const Observation& observation);
  std::vector<SightedPoint>::iterator same_as(const SightedPoint& point);

  LandmarkSensor sensor_;
  LocalMapOptions options_;
  std::uint64_t now_ = 0;
  std::vector<SightedPoint> points_;
  std::vector<double> novelty_;
};

}  // namespace trundle::slam
