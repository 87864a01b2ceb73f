#pragma once

#include <optional>
#include <span>
#include <type_traits>
#include <vector>

#include "trundle/slam/particles/ancestry.hpp"
#include "trundle/slam/particles/forgotten_doubt.hpp"
#include "trundle/slam/particles/landmark_columns.hpp"
#include "trundle/slam/report.hpp"

namespace trundle {

/// The maps of all particles, landmark by landmark. Resampling leaves them alone: a landmark's columns are
/// brought up to now when it is seen again.
class ParticleMap {
 public:
  ParticleMap(std::size_t particles, Precision precision, std::size_t threads = 1);

  std::size_t landmarks() const { return entries_.size(); }
  /// Number of a landmark in this map; kUnknownLandmark: none.
  LandmarkId number_of(LandmarkId id) const;
  /// The same, of one that callers have named.
  LandmarkId find(LandmarkId id) const;
  /// Its columns are counted from `origin`, which should be near it.
  LandmarkId add(LandmarkId id, const Vector2& origin, Ancestry& ancestry);
  /// Columns of today's particles, for reading and writing.
  LandmarkColumns& current(LandmarkId landmark, Ancestry& ancestry);
  /// One that no caller has named; it has an id of its own all the same, but is not found by it.
  LandmarkId add_nameless(const Vector2& origin, Ancestry& ancestry);
  /// Another may get its number, but none its id.
  void remove(LandmarkId landmark, Ancestry& ancestry);
  LandmarkId id_of(LandmarkId landmark) const { return entries_[static_cast<std::size_t>(landmark)].id; }
  /// Whether a particle has it.
  bool has(LandmarkId landmark, std::size_t particle, const Ancestry& ancestry) const;
  /// What particles differ in and have forgotten of where it lies, now that it is in view.
  void set_doubt(LandmarkId landmark, const MapDoubt& doubt);
  void count_sighting(LandmarkId landmark) { ++entries_[static_cast<std::size_t>(landmark)].sightings; }

  /// Mean and covariance over all particles that have it, with these weights: eq. 17, and with what they have
  /// forgotten of its place, eq. 62. Of one that was removed: no sightings.
  MappedLandmark mixture(LandmarkId landmark, std::span<const double> weights, const Ancestry& ancestry,
                         const ForgottenDoubt& forgotten) const;

  /// Its state, for io/archive.hpp. What is in the spare columns' padding comes into the map's.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.spare_, self.entries_, self.index_of_, self.removed_);
    if constexpr (!std::is_const_v<Self>) self.way_.from = self.way_.to = 0;  // another ancestry's
  }

 private:
  struct Entry {
    LandmarkId id;
    Ancestry::Epoch epoch;
    LandmarkColumns columns;
    std::size_t sightings;
    std::optional<Matrix2> doubt = {};  ///< of its place, when it was last in view
    bool has_name = false;
    bool is_there = true;

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.id, self.epoch, self.columns, self.sightings, self.doubt, self.has_name, self.is_there);
    }
  };
  LandmarkId occupy(const Vector2& origin, Ancestry& ancestry);
  void call(LandmarkId landmark, LandmarkId id);
  LandmarkId next_id() const { return static_cast<LandmarkId>(index_of_.size()); }
  void gather(Entry& entry, const Ancestry& ancestry);

  std::size_t particles_;
  Precision precision_;
  std::size_t threads_;
  LandmarkColumns spare_;  ///< columns are gathered into it, and change places with it
  /// From whom to gather: most landmarks in view were last seen in the same epoch.
  struct {
    Ancestry::Epoch from = 0;
    Ancestry::Epoch to = 0;
    Column<Ancestry::Index> ancestors;
  } way_;
  std::vector<Entry> entries_;
  std::vector<LandmarkId> index_of_;  ///< by id
  std::vector<LandmarkId> removed_;   ///< free numbers
};

}  // namespace trundle
