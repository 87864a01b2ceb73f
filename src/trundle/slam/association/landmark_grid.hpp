#pragma once

#include <compare>
#include <cstdint>
#include <map>
#include <unordered_map>
#include <vector>

#include "trundle/geometry/pose2.hpp"

namespace trundle::slam {

/// Landmarks that one sighting may show, the nearest of all: bounds the branches of a joint association.
/// Within a gate of 3 σ lie so many only where landmarks are closer than σ, and then they are one to the
/// sensor.
inline constexpr std::size_t kMostShown = 8;
/// Side of a cell, as a share of the sensor's range: what is found does not depend on it, only the time. With
/// a quarter, what one sighting may show lies in at most four cells and a map in view in about eighty.
inline constexpr double kCellShare = 0.25;
/// Of the sensor's range: landmarks that have moved further in the map are put into the grid again. What is
/// looked up is as much wider; so a wrong share costs time and no match.
inline constexpr double kOffGridShare = 0.05;

/// Which landmarks are near a place, without visiting all: they are kept in square cells.
class LandmarkGrid {
 public:
  explicit LandmarkGrid(double cell_m) : cell_m_(cell_m) {}

  /// Numbers are 0, 1, 2, ...; a landmark that is there already moves.
  void put(std::size_t landmark, const Vector2& place);
  void remove(std::size_t landmark);
  void clear();
  [[nodiscard]] bool contains(std::size_t landmark) const {
    return landmark < places_.size() && places_[landmark].is_there;
  }
  [[nodiscard]] const Vector2& place(std::size_t landmark) const { return places_[landmark].at; }

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
  [[nodiscard]] Cell cell_of(const Vector2& place) const;
  [[nodiscard]] std::map<Cell, std::vector<std::size_t>> sorted_cells() const {
    return {cells_.begin(), cells_.end()};
  }

  double cell_m_;
  std::vector<Place> places_;  ///< by landmark
  std::unordered_map<Cell, std::vector<std::size_t>, Hash> cells_;
};

}  // namespace trundle::slam
