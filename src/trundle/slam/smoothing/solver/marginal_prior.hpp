#pragma once

#include <functional>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "trundle/slam/smoothing/solver/elimination_tree.hpp"

namespace trundle::slam {

/// What terms that are not kept say of landmarks, a pose and the systematic errors: a Gaussian about where
/// all of these were when the terms were linearised. It turns with its landmarks, so that it is as true
/// wherever they are moved together. docs/theory/marginalisation.md, eq. 34.
class MarginalPrior {
 public:
  enum class Kind { landmark, pose, parameters };
  struct Unknown {
    int variable;  ///< of the tree
    Kind kind;
    Eigen::VectorXd at;  ///< (x, y), or (x, y, heading) with what else a pose has, or the parameters

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.variable, self.kind, self.at);
    }
  };
  /// Where a variable is linearised now.
  using Value = std::function<Eigen::VectorXd(int variable)>;

  MarginalPrior() = default;
  /// −2 log p = δᵀ information δ − 2 rightᵀ δ, of moves δ from where the unknowns are, in their order.
  MarginalPrior(std::vector<Unknown> unknowns, Eigen::MatrixXd information, Eigen::VectorXd right);

  [[nodiscard]] const std::vector<Unknown>& unknowns() const { return unknowns_; }
  [[nodiscard]] std::vector<int> variables() const;
  [[nodiscard]] bool has(int variable) const;

  /// The same about where all is now.
  [[nodiscard]] MarginalPrior at(const Value& value) const;
  void add_to(FrontSystem& system) const;
  /// What its first pose becomes by a motion: e = error + by_from δ_from + by_to δ_to + by_parameters δp.
  struct NextPose {
    int from;  ///< variables
    Unknown to;
    Unknown parameters;  ///< of no numbers: none
    Eigen::VectorXd error;
    Eigen::MatrixXd by_from;
    Eigen::MatrixXd by_to;
    Eigen::MatrixXd by_parameters;
    Eigen::MatrixXd information;
  };
  /// What it says, and the motion says, of the next pose and all others.
  [[nodiscard]] MarginalPrior moved_on(const NextPose& next) const;
  /// What it says of the others.
  [[nodiscard]] MarginalPrior marginalised(const std::vector<int>& variables) const;
  /// What it says of variables where the others are given.
  [[nodiscard]] MarginalPrior conditional(const std::vector<int>& variables) const;
  /// Both together, where both are about the same.
  [[nodiscard]] MarginalPrior with(const MarginalPrior& other) const;
  /// Two landmarks are one.
  void merge(int kept, int gone);

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.unknowns_, self.information_, self.right_);
  }

 private:
  [[nodiscard]] MarginalPrior in_order(const std::vector<std::size_t>& order) const;
  /// Its variables in front, then the others.
  [[nodiscard]] std::pair<MarginalPrior, Eigen::Index> led_by(const std::vector<int>& variables) const;
  [[nodiscard]] Eigen::Index begin_of(std::size_t unknown) const;
  /// Where it begins; it is added where it is new.
  Eigen::Index begin_of(const Unknown& unknown);

  std::vector<Unknown> unknowns_;
  Eigen::MatrixXd information_;
  Eigen::VectorXd right_;
};

}  // namespace trundle::slam
