#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include "trundle/geometry/pose2.hpp"

namespace trundle::slam {

/// Places that never move, in square cells that hold one each in the mean: look-up by place takes as long as
/// there are places near it, however many there are in all.
class PlaceGrid {
 public:
  PlaceGrid() = default;
  /// Places are finite [m] and at least one.
  explicit PlaceGrid(std::span<const Vector2> places);

  /// Calls `visit(number of the place)` for each within a radius, in no order that means anything, until
  /// `visit` says that it has seen enough. Returns whether it said so.
  template <class Visit>
  bool visit_until(const Vector2& centre, double radius_m, Visit&& visit) const {
    const std::size_t left = column(centre.x() - radius_m);
    const std::size_t right = column(centre.x() + radius_m);
    const std::size_t bottom = row(centre.y() - radius_m);
    const std::size_t top = row(centre.y() + radius_m);
    for (std::size_t at = bottom * columns_; at <= top * columns_; at += columns_)
      for (std::size_t i = starts_[at + left]; i < starts_[at + right + 1]; ++i)
        if ((places_[i] - centre).squaredNorm() <= radius_m * radius_m && visit(numbers_[i])) return true;
    return false;
  }
  [[nodiscard]] std::size_t count_within(const Vector2& centre, double radius_m) const {
    std::size_t count = 0;
    visit_until(centre, radius_m, [&](std::size_t) { return ++count, false; });
    return count;
  }
  [[nodiscard]] bool has_any_within(const Vector2& centre, double radius_m) const {
    return visit_until(centre, radius_m, [](std::size_t) { return true; });
  }

 private:
  [[nodiscard]] std::size_t column(double x) const { return cell(x - low_.x(), columns_); }
  [[nodiscard]] std::size_t row(double y) const { return cell(y - low_.y(), rows_); }
  /// The first one or the last, where it lies outside; the first one of what is no number.
  [[nodiscard]] std::size_t cell(double from_low_m, std::size_t count) const {
    const double at = from_low_m / cell_m_;
    return at > 0.0 ? static_cast<std::size_t>(std::min(at, static_cast<double>(count - 1))) : 0;
  }

  Vector2 low_ = Vector2::Zero();
  double cell_m_ = 1.0;
  std::size_t columns_ = 1;
  std::size_t rows_ = 1;
  std::vector<std::size_t> starts_ = {0, 0};  ///< of each cell's places, row by row; and the end of the last
  std::vector<Vector2> places_;               ///< cell by cell
  std::vector<std::size_t> numbers_;          ///< of those places
};

}  // namespace trundle::slam
