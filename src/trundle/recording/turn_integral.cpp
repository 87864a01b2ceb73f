#include "trundle/recording/detail/turn_integral.hpp"

#include <algorithm>
#include <utility>

namespace trundle::recording {

namespace {

constexpr std::size_t kStampsOfAnArea = 16;  // half a byte a stamp, and eight steps to add on average

}  // namespace

TurnIntegral::TurnIntegral(Stamps time_s, Turns turns)
    : time_s_(std::move(time_s)), angle_(std::move(turns.turn_rad)), lost_(std::move(turns.lost)) {
  area_of_some_.reserve(time_s_.size() / kStampsOfAnArea + 1);
  auto lost = lost_.begin();
  double angle = 0.0, area = 0.0;
  for (std::size_t i = 0; i < time_s_.size(); ++i) {
    const bool is_lost = lost != lost_.end() && *lost == i;
    if (is_lost) ++lost;
    angle = i == 0 ? 0.0 : angle + (is_lost ? 0.0 : angle_[i]);
    angle_[i] = angle;
    if (i > 0) area += step_area(i);
    if (i % kStampsOfAnArea == 0) area_of_some_.push_back(area);
  }
}

double TurnIntegral::step_area(std::size_t stamp) const {
  return 0.5 * (angle_[stamp - 1] + angle_[stamp]) * (time_s_[stamp] - time_s_[stamp - 1]);
}

double TurnIntegral::area_by(std::size_t stamp) const {
  const std::size_t some = stamp / kStampsOfAnArea;
  double area = area_of_some_[some];
  for (std::size_t i = some * kStampsOfAnArea + 1; i <= stamp; ++i) area += step_area(i);
  return area;
}

TurnIntegral::Reading TurnIntegral::at(double at_s, std::size_t& near) const {
  while (near > 0 && time_s_[near - 1] >= at_s) --near;
  while (near < time_s_.size() && time_s_[near] < at_s) ++near;
  if (near == time_s_.size()) return {};
  if (time_s_[near] == at_s) return {true, area_by(near), lost_until(near), lost_until(near)};
  if (near == 0) return {};
  const double after_s = at_s - time_s_[near - 1];
  const double rate = (angle_[near] - angle_[near - 1]) / (time_s_[near] - time_s_[near - 1]);
  return {true, area_by(near - 1) + after_s * (angle_[near - 1] + 0.5 * rate * after_s), lost_until(near - 1),
          lost_until(near)};
}

std::size_t TurnIntegral::lost_until(std::size_t stamp) const {
  return static_cast<std::size_t>(std::ranges::upper_bound(lost_, stamp) - lost_.begin());
}

}  // namespace trundle::recording
