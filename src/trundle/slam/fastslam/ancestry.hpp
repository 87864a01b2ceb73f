#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "trundle/namespaces.hpp"

namespace trundle::slam {

/// Who descends from whom, so that resampling copies nothing: columns of numbers by particle stay as they
/// were at some epoch, and are gathered when they are next needed. An epoch lasts from one resampling to the
/// next.
///
/// Parents are ascending (systematic resampling keeps the order), hence so is every map from particles to
/// their ancestors, and a map is a few runs of particles with the same ancestor. Their number falls as
/// families die out, about as 2N over the generations: all maps together cost little, however old they are.
class Ancestry {
 public:
  using Epoch = std::uint64_t;
  using Index = std::uint32_t;
  /// Particles from `first` on, up to the next run, descend from `ancestor`.
  struct Run {
    Index first;
    Index ancestor;

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.first, self.ancestor);
    }
  };

  explicit Ancestry(std::size_t particles);

  [[nodiscard]] Epoch now() const { return now_; }
  [[nodiscard]] std::size_t particles() const { return particles_; }

  /// Columns of an epoch are kept track of while somebody holds it.
  void hold(Epoch epoch);
  void release(Epoch epoch);

  /// A new epoch begins. Of each particle its first child, or where it has none that of the next; at the end
  /// the number of all.
  void resample(std::span<const Index> first_child);

  /// The map from today's particles to those of a held epoch.
  [[nodiscard]] std::span<const Run> runs(Epoch epoch) const;
  [[nodiscard]] Index ancestor(Epoch epoch, Index particle) const;
  /// How many particles of a held epoch have descendants.
  [[nodiscard]] std::size_t survivors(Epoch epoch) const;

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.now_, self.generations_);
  }

  /// Each particle's ancestor of a held epoch, runs written out; what stands beyond the particles stays.
  void write_ancestors(Epoch epoch, std::span<Index> ancestors) const;

 private:
  struct Generation {
    std::vector<Run> runs;  ///< empty: everyone is his own ancestor
    std::size_t holders = 0;

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.runs, self.holders);
    }
  };
  void descend(Generation& generation, bool is_youngest) const;

  std::size_t particles_;
  Epoch now_ = 0;
  std::map<Epoch, Generation> generations_;  ///< those held
  std::vector<Index> first_child_;           ///< of each particle of the epoch before, as above
};

}  // namespace trundle::slam
