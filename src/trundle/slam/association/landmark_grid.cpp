#include "trundle/slam/association/landmark_grid.hpp"

#include <algorithm>
#include <cmath>

namespace trundle::slam {

std::size_t LandmarkGrid::Hash::operator()(const Cell& cell) const {
  const auto x = static_cast<std::uint64_t>(static_cast<std::uint32_t>(cell.x));
  const auto y = static_cast<std::uint64_t>(static_cast<std::uint32_t>(cell.y));
  return (x << 32U | y) * 0x9E3779B97F4A7C15U >> 7U;
}

LandmarkGrid::Cell LandmarkGrid::cell_of(const Vector2& place) const {
  constexpr double kFar = 1e9;  // cells; what is further shares the last one
  const auto index = [&](double x) {
    return static_cast<std::int32_t>(std::floor(std::clamp(x / cell_m_, -kFar, kFar)));
  };
  return {index(place.x()), index(place.y())};
}

void LandmarkGrid::put(std::size_t landmark, const Vector2& place) {
  if (places_.size() <= landmark) places_.resize(landmark + 1);
  const bool stays = places_[landmark].is_there && cell_of(places_[landmark].at) == cell_of(place);
  if (!stays) {
    remove(landmark);
    cells_[cell_of(place)].push_back(landmark);
  }
  places_[landmark] = {place, true};
}

void LandmarkGrid::remove(std::size_t landmark) {
  if (!contains(landmark)) return;
  const auto at = cells_.find(cell_of(places_[landmark].at));
  std::erase(at->second, landmark);
  if (at->second.empty()) cells_.erase(at);
  places_[landmark].is_there = false;
}

void LandmarkGrid::clear() {
  places_.clear();
  cells_.clear();
}

void LandmarkGrid::near(const Vector2& place, double radius_m, std::size_t most,
                        std::vector<std::size_t>& found) const {
  found.clear();
  const auto visit = [&](const std::vector<std::size_t>& cell) {
    for (const std::size_t landmark : cell)
      if ((places_[landmark].at - place).squaredNorm() <= radius_m * radius_m) found.push_back(landmark);
  };
  const Cell low = cell_of(place - Vector2::Constant(radius_m));
  const Cell high = cell_of(place + Vector2::Constant(radius_m));
  const double covered = (1.0 + high.x - low.x) * (1.0 + high.y - low.y);
  if (covered > static_cast<double>(cells_.size())) {
    for (const auto& [cell, landmarks] : cells_) visit(landmarks);
  } else {
    for (std::int32_t x = low.x; x <= high.x; ++x)
      for (std::int32_t y = low.y; y <= high.y; ++y)
        if (const auto at = cells_.find({x, y}); at != cells_.end()) visit(at->second);
  }
  const auto distance = [&](std::size_t landmark) {
    return std::pair((places_[landmark].at - place).squaredNorm(), landmark);
  };
  std::ranges::sort(found, {}, distance);
  if (found.size() > most) found.resize(most);
}

}  // namespace trundle::slam
