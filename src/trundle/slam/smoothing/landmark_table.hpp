#pragma once

#include <map>
#include <optional>
#include <vector>

#include "trundle/slam/association/existence.hpp"
#include "trundle/slam/association/landmark_grid.hpp"
#include "trundle/slam/observation.hpp"
#include "trundle/slam/smoothing/factor_graph.hpp"

namespace trundle::slam {

/// Which landmark each of a factor graph's is: its id, whether it surely exists, and where to find it again.
/// Numbers are those of the graph, where each is added, merged or removed first.
class LandmarkTable {
 public:
  LandmarkTable(const Visibility& visibility, double cell_m, LandmarkId first_unidentified)
      : next_unidentified_(first_unidentified), grid_(cell_m), visibility_(visibility) {}

  /// The graph's last one, with the id that its sighting gave it. An unidentified one that has this id gets
  /// another.
  void add_identified(LandmarkId id);
  /// The graph's last one, seen without an id from a viewpoint.
  void add_unidentified(const Vector2& place, const Vector2& viewpoint);
  /// `gone` was `kept` all the time; it is to be removed then.
  void merge(int kept, int gone, const FactorGraph& graph);
  /// The last landmark takes its number; `variable`: the graph's of the one that goes.
  void remove(int landmark, int variable);

  [[nodiscard]] LandmarkId id_of(int landmark) const;
  [[nodiscard]] bool is_identified(int landmark) const;
  [[nodiscard]] bool is_confirmed(int landmark) const;
  [[nodiscard]] Existence& existence(int landmark);
  /// The number of the one with this id; −1: none.
  [[nodiscard]] int with_id(LandmarkId id) const;
  /// Likewise, of those whose id a sighting gave.
  [[nodiscard]] int identified(LandmarkId id) const;
  /// The id that what was once taken for `id` has today: itself, if it is no duplicate.
  [[nodiscard]] LandmarkId merged(LandmarkId id) const;

  [[nodiscard]] Visibility& visibility() { return visibility_; }
  /// Of the unidentified landmarks, where they were; by now they may be `off_grid_m()` from there.
  [[nodiscard]] const LandmarkGrid& grid() const { return grid_; }
  [[nodiscard]] double off_grid_m() const { return off_grid_m_; }
  void note_moved(int landmark, const Vector2& place);
  void refresh_grid(const FactorGraph& graph);

  /// Of landmarks one of which has no name: two that were seen from one pose are two, after the first poses
  /// are marginalised as well.
  void note_seen_together(int first_poses, const FactorGraph& graph);
  [[nodiscard]] bool are_seen_together(int a, int b, const FactorGraph& graph) const;

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.entries_, self.identified_, self.next_unidentified_, self.merged_into_, self.grid_,
            self.off_grid_m_, self.visibility_, self.seen_with_);
  }

 private:
  struct Entry {
    LandmarkId id = kUnknownLandmark;
    bool is_identified = false;
    Existence existence = {};

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.id, self.is_identified, self.existence);
    }
  };
  void note_together(int variable, int other);

  std::vector<Entry> entries_;
  std::map<LandmarkId, int> identified_;  ///< their numbers
  LandmarkId next_unidentified_;
  std::map<LandmarkId, LandmarkId> merged_into_;
  LandmarkGrid grid_;
  double off_grid_m_ = 0.0;  ///< at most so far have they moved since all were put there
  Visibility visibility_;
  std::map<int, std::vector<int>> seen_with_;  ///< variables of the graph, before its first pose
};

}  // namespace trundle::slam
