#pragma once

#include <map>
#include <vector>

#include "trundle/slam/association/landmark_table.hpp"
#include "trundle/slam/smoothing/solver/factor_graph.hpp"

namespace trundle::slam {

/// Landmarks of a factor graph that were seen from one pose are no duplicates: also where that pose is
/// marginalised, which is what is kept here. Of pairs one of which is unidentified.
class SeenTogether {
 public:
  /// The first poses are about to be marginalised.
  void add_first(int poses, const FactorGraph& graph, const LandmarkTable& table);
  /// Variables of the graph: `gone` was `kept` all the time.
  void merge(int kept, int gone);
  /// A variable that goes.
  void remove(int variable);
  /// Landmarks of the graph.
  [[nodiscard]] bool has(int a, int b, const FactorGraph& graph) const;

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.with_);
  }

 private:
  void add(int variable, int other);

  std::map<int, std::vector<int>> with_;  ///< by variable of the graph: others, ascending
};

}  // namespace trundle::slam
