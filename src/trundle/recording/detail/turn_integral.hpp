#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include "trundle/recording/alignment/increments.hpp"

namespace trundle::recording {

/// The stamps of a stream's rows, moved by an offset: none of them is kept as long as those that are added
/// are the same. The stream must outlive it.
class Stamps {
 public:
  explicit Stamps(std::span<const double> stream_s, double offset_s = 0.0)
      : stream_s_(stream_s), offset_s_(offset_s) {}
  /// All of the stream.
  static Stamps of(std::span<const double> stream_s) {
    Stamps stamps(stream_s);
    stamps.size_ = stream_s.size();
    return stamps;
  }

  void push_back(double time_s) {
    own_s_.append(size_++, time_s, stream_s_.size(), [this](std::size_t i) { return moved_s(i); });
  }

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] double operator[](std::size_t i) const {
    return own_s_.empty() ? stream_s_[i] + offset_s_ : own_s_[i];
  }

 private:
  double moved_s(std::size_t i) const {
    return i < stream_s_.size() ? stream_s_[i] + offset_s_ : std::numeric_limits<double>::quiet_NaN();
  }

  std::span<const double> stream_s_;
  double offset_s_;
  std::size_t size_ = 0;
  SparseColumn<double> own_s_;
};

/// How far something turned from each of its stamps to the next.
struct Turns {
  std::vector<double> turn_rad;   ///< of the step that ends at each stamp; of the first it does not count
  std::vector<std::size_t> lost;  ///< stamps that end steps of which nothing is known, in order
};

/// What a sensor has turned by each of its stamps, lost steps as none, and the area under that [rad s]: turns
/// between two times, weighed as one likes, are read off at these. Eight bytes for a stamp, and its own if it
/// has one.
class TurnIntegral {
 public:
  TurnIntegral(Stamps time_s, Turns turns);

  [[nodiscard]] std::size_t stamps() const { return time_s_.size(); }
  [[nodiscard]] double first_s() const { return time_s_[0]; }
  [[nodiscard]] double last_s() const { return time_s_[time_s_.size() - 1]; }

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
  std::size_t lost_until(std::size_t stamp) const;
  double step_area(std::size_t stamp) const;  ///< of the step that ends there
  double area_by(std::size_t stamp) const;

  Stamps time_s_;
  std::vector<double> angle_;         ///< by each stamp
  std::vector<double> area_of_some_;  ///< by each of so many stamps: a longer way to it is not gone
  std::vector<std::size_t> lost_;     ///< stamps that end lost steps
};

}  // namespace trundle::recording
