#include "trundle/recording/alignment/increments.hpp"

#include <cassert>

#include "trundle/statistics/nth_smallest.hpp"

namespace trundle::recording {

static_assert(sizeof(Increment) == (7 + 4 * kMaxWheels) * sizeof(double), "visit() must know a new member");

void Increments::reserve(std::size_t increments) {
  time_s_.reserve(increments);
}

void Increments::push_back(const Increment& increment) {
  const std::size_t i = size();
  if (i == 0) first_duration_s_ = increment.duration_s;
  time_s_.push_back(increment.time_s);
  const std::size_t capacity = time_s_.capacity();
  duration_s_.append(i, increment.duration_s, capacity, [this](std::size_t j) { return between(j); });
  visit(*this, increment, kMaxWheels, [&](auto& column, auto member, auto usual) {
    column.append(i, member, capacity, [usual](std::size_t) { return usual; });
  });
  count_wheels();
}

void Increments::set(std::size_t i, const Increment& increment) {
  assert(increment.time_s == time_s_[i]);
  visit(*this, increment, kMaxWheels, [&](auto& column, auto member, auto usual) {
    column.set(i, member, size(), [usual](std::size_t) { return usual; });
  });
  count_wheels();
}

void Increments::set_gyro_change(std::size_t i, double change_rad_s) {
  gyro_change_rad_s_.set(i, change_rad_s, size(), [](std::size_t) { return 0.0; });
}

void Increments::cut(std::size_t first, std::size_t end) {
  if (first < end) first_duration_s_ = (*this)[first].duration_s;
  duration_s_.cut(first, end);
  visit(*this, Increment{}, wheels_, [&](auto& column, auto, auto) { column.cut(first, end); });
  time_s_ = {time_s_.begin() + static_cast<std::ptrdiff_t>(first),
             time_s_.begin() + static_cast<std::ptrdiff_t>(end)};
}

void Increments::count_wheels() {
  for (std::size_t w = wheels_; w < kMaxWheels; ++w)
    if (!turned_[w].empty() || !slip_variance_[w].empty() || !steering_rad_[w].empty()) wheels_ = w + 1;
}

double usual_interval_s(const Increments& increments) {
  if (increments.empty()) return 0.0;
  return nth_smallest(increments.size(), (increments.size() - 1) / 2,
                      [&](std::size_t i) { return increments.duration_s(i); });
}

}  // namespace trundle::recording
