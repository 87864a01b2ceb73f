#include "trundle/recording/detail/turn_integral.hpp"

#include <algorithm>

namespace trundle::recording {

namespace {

constexpr std::size_t kStampsOfAnArea = 16;

}  // namespace

TurnIntegral::TurnIntegral(std::span<const double> time_s) : time_s_(time_s), count_(time_s.size()) {
  angle_.reserve(count_);
  area_of_some_.reserve(count_ / kStampsOfAnArea + 1);
}

TurnIntegral::TurnIntegral(const Increments& increments)
    : increments_(&increments), count_(increments.size()) {
  angle_.reserve(count_);
  area_of_some_.reserve(count_ / kStampsOfAnArea + 1);
}

void TurnIntegral::add(double turn_rad, bool is_lost) {
  const std::size_t i = angle_.size();
  if (is_lost) lost_.push_back(i);
  angle_.push_back(i == 0 ? 0.0 : angle_.back() + (is_lost ? 0.0 : turn_rad));
  if (i > 0) area_ += step_area(i);
  if (i % kStampsOfAnArea == 0) area_of_some_.push_back(area_);
}

double TurnIntegral::step_area(std::size_t stamp) const {
  return 0.5 * (angle_[stamp - 1] + angle_[stamp]) * (time_s(stamp) - time_s(stamp - 1));
}

double TurnIntegral::area_by(std::size_t stamp) const {
  const std::size_t some = stamp / kStampsOfAnArea;
  double area = area_of_some_[some];
  for (std::size_t i = some * kStampsOfAnArea + 1; i <= stamp; ++i) area += step_area(i);
  return area;
}

TurnIntegral::Reading TurnIntegral::at(double at_s, std::size_t& near) const {
  while (near > 0 && time_s(near - 1) >= at_s) --near;
  while (near < count_ && time_s(near) < at_s) ++near;
  if (near == count_) return {};
  if (time_s(near) == at_s) return {true, area_by(near), lost_until(near), lost_until(near)};
  if (near == 0) return {};
  const double after_s = at_s - time_s(near - 1);
  const double rate = (angle_[near] - angle_[near - 1]) / (time_s(near) - time_s(near - 1));
  return {true, area_by(near - 1) + after_s * (angle_[near - 1] + 0.5 * rate * after_s), lost_until(near - 1),
          lost_until(near)};
}

std::size_t TurnIntegral::lost_until(std::size_t stamp) const {
  return static_cast<std::size_t>(std::ranges::upper_bound(lost_, stamp) - lost_.begin());
}

}  // namespace trundle::recording
