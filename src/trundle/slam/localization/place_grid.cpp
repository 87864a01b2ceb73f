#include "trundle/slam/localization/place_grid.hpp"

#include <cmath>
#include <numeric>

namespace trundle::slam {

PlaceGrid::PlaceGrid(std::span<const Vector2> places) : low_(places.front()) {
  Vector2 high = low_;
  for (const Vector2& place : places) {
    low_ = low_.cwiseMin(place);
    high = high.cwiseMax(place);
  }
  const Vector2 size = high - low_;
  const auto count = static_cast<double>(places.size());
  // Along a line a square of its length over their number holds one; a point needs no size.
  const double cell_m = std::max(std::sqrt(size.prod() / count), size.maxCoeff() / count);
  if (cell_m > 0.0 && std::isfinite(cell_m)) cell_m_ = cell_m;
  const auto cells_along = [&](double length_m) {
    return 1 + static_cast<std::size_t>(std::min(length_m / cell_m_, count));
  };
  columns_ = cells_along(size.x());
  rows_ = cells_along(size.y());

  const auto cell_of = [&](const Vector2& place) { return row(place.y()) * columns_ + column(place.x()); };
  starts_.assign(columns_ * rows_ + 1, 0);
  for (const Vector2& place : places) ++starts_[cell_of(place) + 1];
  std::partial_sum(starts_.begin(), starts_.end(), starts_.begin());
  std::vector<std::size_t> next = starts_;
  places_.resize(places.size());
  numbers_.resize(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    const std::size_t at = next[cell_of(places[i])]++;
    places_[at] = places[i];
    numbers_[at] = i;
  }
}

}  // namespace trundle::slam
