#include "trundle/slam/localization/known_map.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "trundle/io/error.hpp"

namespace trundle::slam {

KnownMap::KnownMap(std::vector<KnownLandmark> landmarks, double reach_m, Eigen::MatrixXd covariance)
    : landmarks_(std::move(landmarks)), covariance_(std::move(covariance)) {
  if (landmarks_.empty()) throw InputError("map", "has no landmark", "at least 1");
  const auto size = 2 * static_cast<Eigen::Index>(landmarks_.size());
  const bool together = covariance_.size() > 0;
  if (together && (covariance_.rows() != size || covariance_.cols() != size || !covariance_.allFinite()))
    throw InputError("map", "has a covariance that is none of its landmarks",
                     "two rows for each, of numbers");
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    const auto at = 2 * static_cast<Eigen::Index>(i);
    if (together) landmarks_[i].covariance = covariance_.block<2, 2>(at, at);
    if (!landmarks_[i].position.allFinite() || !landmarks_[i].covariance.allFinite())
      throw InputError("map", fmt::format("landmark number {} is not finite", i), "numbers [m], [m²]");
    largest_variance_ = std::max(largest_variance_, landmarks_[i].covariance.trace());
  }
  exact_ = largest_variance_ == 0.0;
  std::vector<Vector2> places;
  for (const KnownLandmark& landmark : landmarks_) places.push_back(landmark.position);
  grid_ = PlaceGrid(places);
  for (LandmarkId first = 0; has(first); ++first) {
    const Vector2& place = (*this)[first].position;
    grid_.visit_until(place, reach_m, [&](std::size_t number) {
      const auto second = static_cast<LandmarkId>(number);
      if (first < second) pairs_.push_back({((*this)[second].position - place).norm(), first, second});
      return false;
    });
  }
  std::vector<double> in_view(landmarks_.size(), 1.0);
  for (const Pair& pair : pairs_)
    if (pair.distance_m <= 0.5 * reach_m)
      for (const LandmarkId id : {pair.first, pair.second}) in_view[static_cast<std::size_t>(id)] += 1.0;
  most_in_view_ = std::ranges::max(in_view);
  std::ranges::sort(pairs_, [](const Pair& a, const Pair& b) {
    return std::tie(a.distance_m, a.first, a.second) < std::tie(b.distance_m, b.first, b.second);
  });
}

Matrix2 KnownMap::covariance(LandmarkId one, LandmarkId other) const {
  if (covariance_.size() > 0) return covariance_.block<2, 2>(2 * one, 2 * other);
  return one == other ? (*this)[one].covariance : Matrix2(Matrix2::Zero());
}

Eigen::Matrix<double, 2, Eigen::Dynamic> KnownMap::covariance_with_all(LandmarkId id) const {
  if (covariance_.size() > 0) return covariance_.middleRows<2>(2 * id);
  Eigen::Matrix<double, 2, Eigen::Dynamic> row =
      Eigen::Matrix<double, 2, Eigen::Dynamic>::Zero(2, 2 * static_cast<Eigen::Index>(size()));
  row.middleCols<2>(2 * id) = (*this)[id].covariance;
  return row;
}

double KnownMap::area_m2(double margin_m) const {
  Vector2 low = landmarks_.front().position;
  Vector2 high = low;
  for (const KnownLandmark& landmark : landmarks_) {
    low = low.cwiseMin(landmark.position);
    high = high.cwiseMax(landmark.position);
  }
  return ((high - low).array() + 2.0 * margin_m).prod();
}

std::vector<LandmarkId> KnownMap::within(const Vector2& centre, double radius_m) const {
  std::vector<LandmarkId> found;
  grid_.visit_until(centre, radius_m, [&](std::size_t number) {
    found.push_back(static_cast<LandmarkId>(number));
    return false;
  });
  std::ranges::sort(found, {}, [&](LandmarkId id) { return std::pair((*this)[id].position.x(), id); });
  return found;
}

std::span<const KnownMap::Pair> KnownMap::pairs(double low_m, double high_m) const {
  const auto first = std::ranges::lower_bound(pairs_, low_m, {}, &Pair::distance_m);
  const auto last = std::ranges::upper_bound(pairs_, high_m, {}, &Pair::distance_m);
  return first < last ? std::span<const Pair>(first, last) : std::span<const Pair>();
}

}  // namespace trundle::slam
