#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "trundle/slam/localization/place_grid.hpp"
#include "trundle/slam/models/observation.hpp"

namespace trundle::slam {

/// One landmark of it.
struct KnownLandmark {
  Vector2 position = Vector2::Zero();    ///< in the map [m]
  Matrix2 covariance = Matrix2::Zero();  ///< how well it is known [m²]; zero: exactly
};

/// A map that is not estimated: landmarks by LandmarkId, with look-up by place and by the distance between
/// two.
class KnownMap {
 public:
  /// Two landmarks further apart than `reach_m`, twice the sensor's range, are no pair. Throws InputError
  /// when there is no landmark or a number is none. `covariance` of all of them, x and y of each, where they
  /// are known together; its blocks on the diagonal are then the landmarks' own.
  KnownMap(std::vector<KnownLandmark> landmarks, double reach_m, Eigen::MatrixXd covariance = {});

  [[nodiscard]] std::size_t size() const { return landmarks_.size(); }
  [[nodiscard]] bool has(LandmarkId id) const {
    return id >= 0 && static_cast<std::size_t>(id) < landmarks_.size();
  }
  const KnownLandmark& operator[](LandmarkId id) const { return landmarks_[static_cast<std::size_t>(id)]; }
  /// No landmark has a covariance.
  [[nodiscard]] bool is_exact() const { return exact_; }
  /// Covariance of one landmark's place with that of all, x and y of each.
  [[nodiscard]] Eigen::Matrix<double, 2, Eigen::Dynamic> covariance_with_all(LandmarkId id) const;
  [[nodiscard]] Matrix2 covariance(LandmarkId one, LandmarkId other) const;
  /// Variance along its worst direction of the landmark that is known least.
  [[nodiscard]] double largest_variance() const { return largest_variance_; }
  /// How many landmarks may be in view at once: the most within the sensor's range of one of them.
  [[nodiscard]] double most_in_view() const { return most_in_view_; }
  /// Of the rectangle that holds all landmarks, with a margin [m] on every side.
  [[nodiscard]] double area_m2(double margin_m) const;

  /// All not further from a point than this, by ascending x.
  [[nodiscard]] std::vector<LandmarkId> within(const Vector2& centre, double radius_m) const;
  /// Where they are: their numbers are their LandmarkIds.
  [[nodiscard]] const PlaceGrid& places() const { return grid_; }

  struct Pair {
    double distance_m;
    LandmarkId first;
    LandmarkId second;
  };
  /// Pairs at a distance from `low_m` to `high_m`, by ascending distance; each is there once.
  [[nodiscard]] std::span<const Pair> pairs(double low_m, double high_m) const;

 private:
  std::vector<KnownLandmark> landmarks_;
  Eigen::MatrixXd covariance_;  ///< empty: landmarks are independent
  PlaceGrid grid_;
  std::vector<Pair> pairs_;
  bool exact_ = true;
  double largest_variance_ = 0.0;
  double most_in_view_ = 1.0;
};

}  // namespace trundle::slam
