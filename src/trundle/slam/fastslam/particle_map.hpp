#pragma once

#include <map>
#include <span>
#include <type_traits>
#include <vector>

#include "trundle/slam/fastslam/ancestry.hpp"
#include "trundle/slam/fastslam/landmark_columns.hpp"
#include "trundle/slam/nth.hpp"
#include "trundle/slam/report.hpp"

namespace trundle::slam {

/// The maps of all particles, landmark by landmark. Resampling leaves them alone: a landmark's columns are
/// brought up to now when it is seen again.
class ParticleMap {
 public:
  /// Landmarks without names are numbered from `first_unidentified` on: above all names.
  explicit ParticleMap(std::size_t particles, LandmarkId first_unidentified = 0);

  [[nodiscard]] std::size_t landmarks() const { return entries_.size(); }
  /// Number in this map of a landmark that callers have named; kUnknownLandmark: none.
  [[nodiscard]] LandmarkId find(LandmarkId name) const;
  /// Its columns are counted from `origin`, which should be near it.
  LandmarkId add(LandmarkId name, const Vector2& origin, Ancestry& ancestry);
  /// A landmark as it was last written, and whose of its numbers each of today's particles has.
  struct Stored {
    const LandmarkColumns& columns;
    std::span<const Ancestry::Index> from;
  };
  Stored stored(LandmarkId landmark, const Ancestry& ancestry);
  /// Columns of today's particles, for reading and writing, once what is requested is gathered.
  LandmarkColumns& request(LandmarkId landmark, Ancestry& ancestry);
  /// Some of them do. All have to, before landmarks are added or the next epoch begins.
  void gather(ParticleRange range);
  void end_gather() { pending_.clear(); }
  /// The same at once, for all particles.
  LandmarkColumns& current(LandmarkId landmark, Ancestry& ancestry);
  /// One that no caller has named; it has an id of its own all the same, but is not found by it.
  LandmarkId add_unidentified(const Vector2& origin, Ancestry& ancestry);
  /// One without a name. Another may get its number, but none its id.
  void remove(LandmarkId landmark, Ancestry& ancestry);
  [[nodiscard]] LandmarkId id_of(LandmarkId landmark) const { return entries_[nth(landmark)].id; }
  /// Whether a particle has it.
  [[nodiscard]] bool has(LandmarkId landmark, std::size_t particle, const Ancestry& ancestry) const;
  void count_sighting(LandmarkId landmark) { ++entries_[nth(landmark)].sightings; }

  /// Mean and covariance over all particles that have it, with these weights: eq. 17. Of one that was
  /// removed: no sightings.
  [[nodiscard]] MappedLandmark mixture(LandmarkId landmark, std::span<const double> weights,
                                       const Ancestry& ancestry) const;

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.entries_, self.named_, self.unidentified_, self.next_unidentified_, self.removed_);
    if constexpr (!std::is_const_v<Self>) self.ancestor_maps_known_ = 0;  // another ancestry's
  }

 private:
  struct Entry {
    LandmarkId id;
    Ancestry::Epoch epoch;
    LandmarkColumns columns;
    std::size_t sightings;
    bool is_there = true;

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.id, self.epoch, self.columns, self.sightings, self.is_there);
    }
  };
  LandmarkId occupy(const Vector2& origin, Ancestry& ancestry);
  void number_unidentified(LandmarkId landmark);
  std::size_t ancestor_map_from(Ancestry::Epoch epoch, const Ancestry& ancestry);

  std::size_t particles_;
  /// Whose columns of an epoch today's particles have: most landmarks in view were written in the same.
  struct AncestorMap {
    Ancestry::Epoch from;
    Column<Ancestry::Index> ancestors;
  };
  std::vector<AncestorMap> ancestor_maps_;
  std::size_t ancestor_maps_known_ = 0;  ///< so many of them lead to the epoch `ancestor_maps_to_`
  Ancestry::Epoch ancestor_maps_to_ = 0;
  /// A landmark whose columns are to be filled from those it had.
  struct PendingGather {
    LandmarkId landmark;
    std::size_t ancestor_map;
  };
  std::vector<PendingGather> pending_;
  std::vector<LandmarkColumns> before_;            ///< the columns that they are filled from
  static constexpr std::size_t kMostAtATime = 64;  ///< of both: more would only take more memory
  std::vector<Entry> entries_;
  std::vector<LandmarkId> named_;                  ///< by name
  std::map<LandmarkId, LandmarkId> unidentified_;  ///< by id
  LandmarkId next_unidentified_;
  std::vector<LandmarkId> removed_;  ///< free numbers, with the room of those who had them
};

}  // namespace trundle::slam
