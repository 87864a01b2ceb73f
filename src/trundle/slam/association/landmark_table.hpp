#pragma once

#include <map>
#include <vector>

#include "trundle/slam/association/existence.hpp"
#include "trundle/slam/association/landmark_grid.hpp"
#include "trundle/slam/nth.hpp"
#include "trundle/slam/report.hpp"

namespace trundle::slam {

/// Which landmark each of a map is, for filters whose map is one Gaussian: its id, whether it surely exists,
/// and where to find it again. Numbers are those of the map, where each is added or removed first.
class LandmarkTable {
 public:
  /// Unidentified landmarks are numbered from `first_unidentified` on.
  LandmarkTable(double max_range_m, LandmarkId first_unidentified)
      : next_unidentified_(first_unidentified), grid_(kCellShare * max_range_m), visibility_(max_range_m) {}

  /// The map's last one, with the id that its sighting gave it. An unidentified one that has this id gets
  /// another.
  void add_identified(LandmarkId id);
  /// The map's last one, seen without an id from a viewpoint.
  void add_unidentified(const Vector2& place, const Vector2& viewpoint);
  /// The last landmark takes its number.
  void remove(int landmark);

  [[nodiscard]] std::size_t size() const { return entries_.size(); }
  [[nodiscard]] LandmarkId id_of(int landmark) const { return entry(landmark).id; }
  /// Its sighting had an id: it exists.
  [[nodiscard]] bool is_identified(int landmark) const { return entry(landmark).is_identified; }
  [[nodiscard]] bool is_confirmed(int landmark) const;
  [[nodiscard]] Existence& existence(int landmark) { return entry(landmark).existence; }
  /// How often it was seen, the sighting that created it among them.
  [[nodiscard]] std::size_t sightings(int landmark) const { return entry(landmark).sightings; }
  void add_sightings(int landmark, std::size_t count) { entry(landmark).sightings += count; }
  /// The number of the one with this id; kNone: none.
  static constexpr int kNone = -1;
  [[nodiscard]] int with_id(LandmarkId id) const;
  /// Likewise, of those whose id a sighting gave.
  [[nodiscard]] int identified(LandmarkId id) const;

  [[nodiscard]] Visibility& visibility() { return visibility_; }
  /// Of the unidentified landmarks, where they were; by now they may be `off_grid_m()` from there.
  [[nodiscard]] const LandmarkGrid& grid() const { return grid_; }
  [[nodiscard]] double off_grid_m() const { return off_grid_m_; }
  /// A landmark's mean has been updated.
  void note_moved(int landmark, const Vector2& place);
  /// Puts all unidentified landmarks into the grid where they are today: `place_of(number)`.
  template <class PlaceOf>
  void refresh_grid(const PlaceOf& place_of) {
    grid_.clear();
    for (std::size_t i = 0; i < entries_.size(); ++i)
      if (!entries_[i].is_identified) grid_.put(i, place_of(static_cast<int>(i)));
    off_grid_m_ = 0.0;
  }

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.entries_, self.identified_, self.next_unidentified_, self.grid_, self.off_grid_m_,
            self.visibility_);
  }

 private:
  struct Entry {
    LandmarkId id = kUnknownLandmark;
    bool is_identified = false;
    std::size_t sightings = 0;
    Existence existence = {};

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.id, self.is_identified, self.sightings, self.existence);
    }
  };
  [[nodiscard]] Entry& entry(int landmark) { return entries_[nth(landmark)]; }
  [[nodiscard]] const Entry& entry(int landmark) const { return entries_[nth(landmark)]; }

  std::vector<Entry> entries_;
  std::map<LandmarkId, int> identified_;  ///< their numbers
  LandmarkId next_unidentified_;
  LandmarkGrid grid_;
  double off_grid_m_ = 0.0;  ///< at most so far have they moved since all were put there
  Visibility visibility_;
};

}  // namespace trundle::slam
