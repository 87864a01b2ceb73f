#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "trundle/recording/alignment/increments.hpp"

namespace trundle::recording {

/// What a sensor has turned by each of its stamps, lost steps as none, and the area under that [rad s]: turns
/// between two times, weighed as one likes, are read off at these. Eight bytes for a stamp, and the stamps
/// themselves, which must outlive it.
class TurnIntegral {
 public:
  explicit TurnIntegral(std::span<const double> time_s);
  explicit TurnIntegral(const Increments& increments);  ///< their ends are the stamps

  /// From the stamp before to the next one; of the first the turn does not count.
  void add(double turn_rad, bool is_lost);

  [[nodiscard]] double first_s() const { return time_s(0); }
  [[nodiscard]] double last_s() const { return time_s(count_ - 1); }

  /// The area by one time; not known beyond the stamps.
  struct Reading {
    bool known = false;
    double area = 0.0;
    std::size_t lost_before = 0;  ///< steps up to the stamp before the time, or at it
    std::size_t lost_after = 0;   ///< and up to the stamp after it, or at it
  };
  /// At a constant rate from stamp to stamp. `near`: where the stamp is looked for, and then the first that
  /// is not before the time.
  [[nodiscard]] Reading at(double time_s, std::size_t& near) const;

 private:
  double time_s(std::size_t stamp) const {
    return increments_ != nullptr ? increments_->time_s(stamp) : time_s_[stamp];
  }
  std::size_t lost_until(std::size_t stamp) const;
  double step_area(std::size_t stamp) const;  ///< of the step that ends there
  double area_by(std::size_t stamp) const;

  std::span<const double> time_s_;
  const Increments* increments_ = nullptr;
  std::size_t count_ = 0;  ///< of stamps
  std::vector<double> angle_;
  double area_ = 0.0;                 ///< by the last one
  std::vector<double> area_of_some_;  ///< by each of so many stamps: a longer way to it is not gone
  std::vector<std::size_t> lost_;     ///< stamps that end lost steps
};

}  // namespace trundle::recording
