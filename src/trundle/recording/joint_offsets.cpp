#include "trundle/recording/detail/joint_offsets.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

namespace trundle::recording {
namespace {

using Vector2d = Eigen::Vector2d;
using Matrix2d = Eigen::Matrix2d;

constexpr double kSettled_s = 2e-5;  // far below the sigma of any log
constexpr int kMostSteps = 30;
// Lines from which the squares' bend in every direction follows.
const std::array kLines = {Vector2d(1.0, 0.0), Vector2d(0.0, 1.0), Vector2d(1.0, 1.0)};
constexpr std::size_t kBoth = 2;

/// Two clocks moved along a line through a place, in the windows that are left.
TwoClocks along(const JointClocks& clocks, const Vector2d& place_s, const Vector2d& line) {
  return {.fixed = clocks.fixed,
          .duration_s = clocks.duration_s,
          .used = clocks.used,
          .moved = [&clocks, place_s, line](double offset_s, std::vector<bool>& used) {
            return clocks.moved(place_s + offset_s * line, used);
          }};
}
Comparer comparer_along(const JointClocks& clocks, const Vector2d& place_s, const Vector2d& line) {
  return Comparer(along(clocks, place_s, line));
}

/// The comparison at a place, and beside it on each line.
struct Around {
  Comparison here;
  std::array<Comparison, kLines.size()> before, after;
  double step_s = 0.0;

  Change change(std::size_t line) const { return {before[line], here, after[line], step_s}; }
  bool is_of_same_windows() const {
    return change(0).is_of_same_windows() && change(1).is_of_same_windows() &&
           change(kBoth).is_of_same_windows();
  }
  /// How half the squares bend.
  Matrix2d information() const {
    const double first = change(0).information(), second = change(1).information();
    const double mixed = 0.5 * (change(kBoth).information() - first - second);
    return (Matrix2d() << first, mixed, mixed, second).finished();
  }
  Vector2d slope() const { return {change(0).slope(), change(1).slope()}; }
};

Around around(JointClocks& clocks, const Vector2d& place_s) {
  Around result;
  result.step_s = clocks.search[0].change_s;
  do {  // until no window is missed any more
    for (std::size_t i = 0; i < kLines.size(); ++i) {
      Comparer compare = comparer_along(clocks, place_s, kLines[i]);
      result.before[i] = compare.at(-result.step_s);
      result.after[i] = compare.at(result.step_s);
      if (i == 0) result.here = compare.at(0.0);
      clocks.used = compare.windows();
    }
  } while (!result.is_of_same_windows());
  return result;
}

bool is_positive(const Matrix2d& information) {
  return information(0, 0) > 0.0 && information.determinant() > 0.0;
}

/// The least squares near a place; nothing where they do not bend in every direction.
std::optional<Vector2d> settled(JointClocks& clocks, Vector2d place_s) {
  for (int i = 0; i < kMostSteps; ++i) {
    const Around here = around(clocks, place_s);
    const Matrix2d information = here.information();
    if (!is_positive(information)) return std::nullopt;
    Vector2d step_s = -(information.inverse() * here.slope());
    const double size_s = step_s.norm(), most_s = clocks.search[0].step_s;
    if (size_s > most_s) step_s *= most_s / size_s;
    place_s += step_s;
    if (size_s < kSettled_s) return place_s;
  }
  return std::nullopt;
}

/// What each window moves both offsets by, in Newton's step.
Eigen::MatrixXd moved_by(const Around& here) {
  const Eigen::VectorXd first = here.change(0).score();
  Eigen::MatrixXd scores(first.size(), 2);
  scores << first, here.change(1).score();
  return scores * here.information().inverse();
}

bool has_enough(const JointClocks& clocks) {
  return comparer_along(clocks, Vector2d::Zero(), kLines[0]).has_enough();
}

/// The least squares, with windows where a wheel slips left out.
std::optional<Vector2d> settled_offsets(JointClocks& clocks) {
  Vector2d place_s(clocks.search[0].given_s, clocks.search[1].given_s);
  for (const std::size_t line : {std::size_t{1}, std::size_t{0}, kBoth}) {
    if (!has_enough(clocks)) return std::nullopt;
    const OffsetSearch& search = clocks.search[line % 2];
    Comparer compare = comparer_along(clocks, place_s, kLines[line]);
    place_s += search_from(compare, 0.0, search.largest_s, search.step_s) * kLines[line];
    clocks.used = compare.windows();
  }
  Comparer compare = comparer_along(clocks, place_s, kLines[0]);
  if (!compare.has_enough()) return std::nullopt;
  compare.leave_out_slip(0.0);
  clocks.used = compare.windows();
  return has_enough(clocks) ? settled(clocks, place_s) : std::nullopt;
}

/// Whether the squares are less, by more than chance, than anywhere on the line `free` through the place
/// where what is `off_s` is as given: where a wheel is steered at rest any offset does as long as the rest
/// lasts, and how the squares bend there says nothing.
bool is_clearly_better_than_given(const JointClocks& clocks, const Vector2d& offsets_s, double off_s,
                                  std::size_t free) {
  const Vector2d across = free == 0 ? kLines[1] : kLines[0];
  Vector2d place_s = offsets_s - off_s * across;
  const OffsetSearch& search = clocks.search[free % 2];
  Comparer along = comparer_along(clocks, place_s, kLines[free]);
  place_s += search_from(along, 0.0, search.largest_s, search.step_s) * kLines[free];
  Comparer compare = comparer_along(clocks, place_s, offsets_s - place_s);
  compare.use(along.windows());
  return compare.is_clearly_not(0.0, 1.0);
}

/// With the second one as it is given.
std::optional<TimeOffset> first_alone(const JointClocks& clocks) {
  auto found = find_offset(
      {.clocks = along(clocks, {0.0, clocks.search[1].given_s}, kLines[0]), .search = clocks.search[0]});
  if (found) found->offset_s -= clocks.search[0].given_s;
  return found;
}

}  // namespace

JointOffsets find_offsets(const JointClocks& given) {
  JointClocks clocks = given;
  const std::optional<Vector2d> offsets_s = settled_offsets(clocks);
  if (!offsets_s) return {.each = {}, .apart = first_alone(given)};
  const Around here = around(clocks, *offsets_s);
  if (!is_positive(here.information())) return {.each = {}, .apart = first_alone(given)};
  const Eigen::MatrixXd moved = moved_by(here);
  const Vector2d given_s(clocks.search[0].given_s, clocks.search[1].given_s);
  const Vector2d off_s = *offsets_s - given_s;
  // `free`: the line along which the clocks may be moved without what is told being any other than given.
  const auto told = [&](double told_off_s, const Eigen::VectorXd& moved_s, std::size_t i,
                        std::size_t free) -> std::optional<TimeOffset> {
    const OffsetSearch& search = clocks.search[i];
    const double sigma_s = std::hypot(std::sqrt(variance_of_sum(moved_s)), search.least_sigma_s);
    if (!speak_of_one_motion(here.here, search) || !(sigma_s <= search.largest_sigma_s) ||
        std::abs(told_off_s) > search.largest_s)
      return std::nullopt;
    const bool is_near = std::abs(told_off_s) <= kSignificant * sigma_s;
    if (!is_near && !is_clearly_better_than_given(clocks, *offsets_s, told_off_s, free)) return std::nullopt;
    return TimeOffset{told_off_s, sigma_s, here.here.correlation()};
  };
  JointOffsets found{.each = {told(off_s[0], moved.col(0), 0, 1), told(off_s[1], moved.col(1), 1, 0)},
                     .apart = told(off_s[0] - off_s[1], moved.col(0) - moved.col(1), 0, kBoth)};
  for (std::size_t i = 0; i < 2; ++i)
    if (found.each[i]) found.each[i]->offset_s += clocks.search[i].given_s;
  return found;
}

}  // namespace trundle::recording
