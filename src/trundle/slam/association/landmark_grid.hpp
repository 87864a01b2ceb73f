#pragma once

#include <compare>
#include <cstdint>
#include <map>
#include <unordered_map>
#include <vector>

#include "trundle/geometry/pose2.hpp"

namespace trundle {

/// Landmarks that one sighting may show, the nearest of all.
inline constexpr std::size_t kMostShown = 8;

/// Which landmarks are near a place, without visiting all: they are kept in square cells.
class LandmarkGrid {
 public:
  explicit LandmarkGrid(double cell_m) : cell_m_(cell_m) {}

  /// Numbers are 0, 1, 2, ...; a landmark that is there already moves.
  void put(std::size_t landmark, const Vector2& place);
  void remove(std::size_t landmark);
  void clear();
  bool contains(std::size_t landmark) const {
    return landmark < places_.size() && places_[landmark].is_there;
  }
  const Vector2& place(std::size_t landmark) const { return places_[landmark].at; }

  /// Those within a radius, the nearest first, at most so many. Work grows with the landmarks there.
  void near(const Vector2& place, double radius_m, std::size_t most, std::vector<std::size_t>& found) const;

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.places_);
    auto cells = self.sorted_cells();
    archive(cells);
    if constexpr (Archive::kReads) self.cells_ = {cells.begin(), cells.end()};
  }

 private:
  struct Cell {
    std::int32_t x, y;
    auto operator<=>(const Cell&) const = default;

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.x, self.y);
    }
  };
  struct Hash {
    std::size_t operator()(const Cell& cell) const;
  };
  struct Place {
    Vector2 at = Vector2::Zero();
    bool is_there = false;

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.at, self.is_there);
    }
  };
  Cell cell_of(const Vector2& place) const;
  std::map<Cell, std::vector<std::size_t>> sorted_cells() const { return {cells_.begin(), cells_.end()}; }

  double cell_m_;
  std::vector<Place> places_;  ///< by landmark
  std::unordered_map<Cell, std::vector<std::size_t>, Hash> cells_;
};

}  // namespace trundle
