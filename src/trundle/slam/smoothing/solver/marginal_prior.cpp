#include "trundle/slam/smoothing/solver/marginal_prior.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "trundle/geometry/decompositions.hpp"
#include "trundle/geometry/rigid_motion.hpp"
#include "trundle/io/error.hpp"
#include "trundle/slam/nth.hpp"

namespace trundle::slam {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// How places that are moved turn about their middle, which moves with them.
struct TurnOfPlaces {
  Vector2 before = Vector2::Zero();  ///< the middle
  Vector2 now = Vector2::Zero();     ///< likewise
  double angle_rad = 0.0;

  /// How far a place is moved: as if nothing had turned, and to first order by the turn.
  [[nodiscard]] Vector2 moved(const Vector2& from, const Vector2& to) const {
    const Vector2 arm = from - before;
    return now + rotation(-angle_rad) * (to - now) - from + angle_rad * Vector2(-arm.y(), arm.x());
  }
};

TurnOfPlaces turn_of(const std::vector<MarginalPrior::Unknown>& before, const std::vector<VectorXd>& now) {
  std::vector<PointPair> places;
  for (std::size_t i = 0; i < before.size(); ++i)
    if (before[i].kind != MarginalPrior::Kind::parameters)
      places.push_back({before[i].at.head<2>(), now[i].head<2>()});
  const std::optional<Pose2> now_from_before = rigid_motion(places);
  if (!now_from_before) return {};
  Vector2 middle = Vector2::Zero();
  for (const PointPair& place : places) middle += place.from / static_cast<double>(places.size());
  return {middle, *now_from_before * middle, now_from_before->heading};
}

/// What eliminating the first numbers leaves of the rest, and what it takes away.
struct FirstEliminated {
  MatrixXd L2;
  VectorXd reduced;
  MatrixXd rest;
};
// Eq. 21. What hardly anything is known of, as a landmark that others are given by, may have less than
// nothing by rounding: then the least share of the largest is added that makes it something.
FirstEliminated eliminate_first(const MatrixXd& matrix, const VectorXd& right, Index columns) {
  const Index rows = matrix.rows() - columns;
  const double largest = matrix.diagonal().head(columns).maxCoeff();
  MatrixXd A = matrix;
  for (double ridge = kLeastRidge; !geometry::eliminate_columns(A, columns); ridge *= 10.0) {
    if (ridge > kMostRidge) throw CannotAnswer("the sightings leave poses or landmarks undetermined");
    A = matrix;
    A.diagonal().head(columns).array() += ridge * largest;
  }
  VectorXd reduced = right.head(columns);
  A.topLeftCorner(columns, columns).triangularView<Eigen::Lower>().solveInPlace(reduced);
  return {A.bottomLeftCorner(rows, columns), std::move(reduced),
          A.bottomRightCorner(rows, rows).selfadjointView<Eigen::Lower>()};
}

}  // namespace

MarginalPrior::MarginalPrior(std::vector<Unknown> unknowns, MatrixXd information, VectorXd right)
    : unknowns_(std::move(unknowns)), information_(std::move(information)), right_(std::move(right)) {}

std::vector<int> MarginalPrior::variables() const {
  std::vector<int> variables;
  for (const Unknown& unknown : unknowns_) variables.push_back(unknown.variable);
  return variables;
}

bool MarginalPrior::has(int variable) const {
  return std::ranges::find(unknowns_, variable, &Unknown::variable) != unknowns_.end();
}

Index MarginalPrior::begin_of(std::size_t unknown) const {
  Index begin = 0;
  for (std::size_t i = 0; i < unknown; ++i) begin += unknowns_[i].at.size();
  return begin;
}

// Eq. 34.
MarginalPrior MarginalPrior::at(const Value& value) const {
  std::vector<VectorXd> now;
  bool is_same = true;
  for (const Unknown& unknown : unknowns_) {
    now.push_back(value(unknown.variable));
    is_same = is_same && now.back() == unknown.at;
  }
  if (is_same) return *this;
  const TurnOfPlaces turn = turn_of(unknowns_, now);
  MarginalPrior result = *this;
  VectorXd moved(right_.size());
  Index begin = 0;
  for (std::size_t i = 0; i < unknowns_.size(); ++i) {
    const VectorXd& before = unknowns_[i].at;
    VectorXd by = now[i] - before;
    Matrix2 axes = Matrix2::Identity();  // of the move from now on, in those of before
    if (unknowns_[i].kind == Kind::landmark) {
      by = turn.moved(before, now[i]);
      axes = rotation(-turn.angle_rad);
    } else if (unknowns_[i].kind == Kind::pose) {
      by.head<2>() = rotation(-before[2]) * turn.moved(before.head<2>(), now[i].head<2>());
      by[2] = wrap_angle(by[2]);
      axes = rotation(by[2] - turn.angle_rad);
    }
    moved.segment(begin, before.size()) = by;
    if (unknowns_[i].kind != Kind::parameters) {
      result.information_.middleCols<2>(begin) = result.information_.middleCols<2>(begin).eval() * axes;
      result.information_.middleRows<2>(begin) =
          axes.transpose() * result.information_.middleRows<2>(begin).eval();
    }
    begin += before.size();
  }
  result.right_.noalias() -= information_ * moved;
  begin = 0;
  for (std::size_t i = 0; i < unknowns_.size(); ++i) {
    if (unknowns_[i].kind == Kind::landmark)
      result.right_.segment<2>(begin) = rotation(turn.angle_rad) * result.right_.segment<2>(begin).eval();
    else if (unknowns_[i].kind == Kind::pose)
      result.right_.segment<2>(begin) =
          rotation(turn.angle_rad - moved[begin + 2]) * result.right_.segment<2>(begin).eval();
    begin += now[i].size();
    result.unknowns_[i].at = std::move(now[i]);
  }
  return result;
}

void MarginalPrior::add_to(FrontSystem& system) const {
  Index row = 0;
  for (const Unknown& i : unknowns_) {
    Index column = 0;
    for (const Unknown& j : unknowns_) {
      if (column > row) break;
      system.add(i.variable, j.variable, information_.block(row, column, i.at.size(), j.at.size()));
      column += j.at.size();
    }
    system.add(i.variable, right_.segment(row, i.at.size()));
    row += i.at.size();
  }
}

MarginalPrior MarginalPrior::in_order(const std::vector<std::size_t>& order) const {
  MarginalPrior result;
  std::vector<Index> rows;
  for (const std::size_t i : order) {
    result.unknowns_.push_back(unknowns_[i]);
    for (Index k = 0; k < unknowns_[i].at.size(); ++k) rows.push_back(begin_of(i) + k);
  }
  result.information_ = information_(rows, rows);
  result.right_ = right_(rows);
  return result;
}

std::pair<MarginalPrior, Index> MarginalPrior::led_by(const std::vector<int>& variables) const {
  std::vector<std::size_t> order(unknowns_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto leads = [&](std::size_t i) {
    return std::ranges::find(variables, unknowns_[i].variable) != variables.end();
  };
  const auto others = std::stable_partition(order.begin(), order.end(), leads);
  Index columns = 0;
  for (auto i = order.begin(); i != others; ++i) columns += unknowns_[*i].at.size();
  return {in_order(order), columns};
}

MarginalPrior MarginalPrior::marginalised(const std::vector<int>& variables) const {
  auto [result, columns] = led_by(variables);
  if (columns == 0) return result;
  const FirstEliminated parts = eliminate_first(result.information_, result.right_, columns);
  result.information_ = parts.rest;
  result.right_ = (result.right_.tail(parts.rest.rows()) - parts.L2 * parts.reduced).eval();
  std::erase_if(result.unknowns_, [&](const Unknown& unknown) {
    return std::ranges::find(variables, unknown.variable) != variables.end();
  });
  return result;
}

/// Eq. 33. Eliminating the pose instead of the motion's error would leave, of poses that hardly move against
/// each other, the rounding of their stiff tie.
MarginalPrior MarginalPrior::moved_on(const NextPose& next) const {
  MarginalPrior result = *this;
  const Index from = result.begin_of(*std::ranges::find(unknowns_, next.from, &Unknown::variable));
  const Index to = result.begin_of(next.to);
  const Index parameters = next.parameters.at.size() > 0 ? result.begin_of(next.parameters) : 0;
  const Index n = next.error.size();
  const MatrixXd by_error = geometry::inverse_of(next.by_from);
  const MatrixXd by_to = -by_error * next.by_to;
  const MatrixXd by_parameters = -by_error * next.by_parameters;
  const auto substitute = [&](auto& columns) {
    columns.middleCols(to, n) += columns.middleCols(from, n) * by_to;
    columns.middleCols(parameters, by_parameters.cols()) += columns.middleCols(from, n) * by_parameters;
    columns.middleCols(from, n) = (columns.middleCols(from, n) * by_error).eval();
  };
  substitute(result.information_);
  result.information_.transposeInPlace();
  substitute(result.information_);
  MatrixXd right = result.right_.transpose();
  substitute(right);
  result.right_ = right.transpose();
  result.information_.block(from, from, n, n) += next.information;
  result.right_.segment(from, n) -= next.information * next.error;
  return result.marginalised({next.from});
}

Index MarginalPrior::begin_of(const Unknown& unknown) {
  const auto found = std::ranges::find(unknowns_, unknown.variable, &Unknown::variable);
  if (found != unknowns_.end()) return begin_of(nth(found - unknowns_.begin()));
  const Index begin = right_.size();
  const Index size = begin + unknown.at.size();
  unknowns_.push_back(unknown);
  information_.conservativeResizeLike(MatrixXd::Zero(size, size));
  right_.conservativeResizeLike(VectorXd::Zero(size));
  return begin;
}

MarginalPrior MarginalPrior::conditional(const std::vector<int>& variables) const {
  auto [result, columns] = led_by(variables);
  const FirstEliminated parts = eliminate_first(result.information_, result.right_, columns);
  const Index rows = parts.rest.rows();
  result.information_.bottomRightCorner(rows, rows) = parts.L2 * parts.L2.transpose();
  result.right_.tail(rows) = parts.L2 * parts.reduced;
  return result;
}

MarginalPrior MarginalPrior::with(const MarginalPrior& other) const {
  MarginalPrior both = *this;
  std::vector<Index> rows;  // of the other's numbers
  for (const Unknown& unknown : other.unknowns_) {
    const Index begin = both.begin_of(unknown);
    for (Index k = 0; k < unknown.at.size(); ++k) rows.push_back(begin + k);
  }
  for (std::size_t j = 0; j < rows.size(); ++j) {
    const auto from = static_cast<Index>(j);
    both.right_[rows[j]] += other.right_[from];
    for (std::size_t i = 0; i < rows.size(); ++i)
      both.information_(rows[i], rows[j]) += other.information_(static_cast<Index>(i), from);
  }
  return both;
}

/// Moves of the one that goes are those of the other, from where that is.
void MarginalPrior::merge(int kept, int gone) {
  const auto unknown = [&](int variable) {
    return std::ranges::find(unknowns_, variable, &Unknown::variable);
  };
  const auto goes = unknown(gone);
  if (goes == unknowns_.end()) return;
  const auto stays = unknown(kept);
  if (stays == unknowns_.end()) {
    goes->variable = kept;
    return;
  }
  const Index from = begin_of(nth(goes - unknowns_.begin()));
  const Index to = begin_of(nth(stays - unknowns_.begin()));
  right_ -= information_.middleCols<2>(from) * (stays->at - goes->at);
  right_.segment<2>(to) += right_.segment<2>(from).eval();
  information_.middleCols<2>(to) += information_.middleCols<2>(from).eval();
  information_.middleRows<2>(to) += information_.middleRows<2>(from).eval();
  std::vector<std::size_t> others(unknowns_.size());
  std::iota(others.begin(), others.end(), std::size_t{0});
  others.erase(others.begin() + (goes - unknowns_.begin()));
  *this = in_order(others);
}

}  // namespace trundle::slam
