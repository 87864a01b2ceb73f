#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <span>
#include <vector>

#include "trundle/chassis/chassis.hpp"

namespace trundle::recording {

/// Numbers of which none is kept as long as all of them are what is usual.
template <class T>
class SparseColumn {
 public:
  [[nodiscard]] bool empty() const { return values_.empty(); }
  [[nodiscard]] T operator[](std::size_t i) const { return values_[i]; }

  /// `usual`: a function of the index, for those before it that were not kept.
  template <class Usual>
  void append(std::size_t size, T value, std::size_t capacity, const Usual& usual) {
    if (empty() && is_same(value, usual(size))) return;
    fill(size, capacity, usual);
    values_.push_back(value);
  }
  template <class Usual>
  void set(std::size_t i, T value, std::size_t size, const Usual& usual) {
    if (empty() && is_same(value, usual(i))) return;
    fill(size, size, usual);
    values_[i] = value;
  }
  void cut(std::size_t first, std::size_t end) {
    if (!empty()) values_ = {at(first), at(end)};
  }

 private:
  static bool is_same(double a, double b) {  // NaN is NaN, and −0 is not 0
    return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
  }
  auto at(std::size_t i) const { return values_.begin() + static_cast<std::ptrdiff_t>(i); }

  template <class Usual>
  void fill(std::size_t size, std::size_t capacity, const Usual& usual) {
    if (!empty()) return;
    values_.reserve(capacity);
    for (std::size_t i = 0; i < size; ++i) values_.push_back(usual(i));
  }

  std::vector<T> values_;
};

/// Increments in columns, read and written as values: of what no increment holds there is no column, nor of
/// durations that are the differences of the stamps.
class Increments {
 public:
  class Iterator;

  Increments() = default;
  explicit Increments(std::span<const Increment> increments) {
    reserve(increments.size());
    for (const Increment& increment : increments) push_back(increment);
  }

  [[nodiscard]] std::size_t size() const { return time_s_.size(); }
  [[nodiscard]] bool empty() const { return time_s_.empty(); }
  [[nodiscard]] double time_s(std::size_t i) const { return time_s_[i]; }
  [[nodiscard]] double duration_s(std::size_t i) const {
    return duration_s_.empty() ? between(i) : duration_s_[i];
  }
  /// NaN where it has no gyro.
  [[nodiscard]] double gyro_rad(std::size_t i) const {
    if (has_gyro_.empty() || !has_gyro_[i]) return std::numeric_limits<double>::quiet_NaN();
    return gyro_rad_.empty() ? 0.0 : gyro_rad_[i];
  }
  [[nodiscard]] Increment operator[](std::size_t i) const {
    Increment increment{.time_s = time_s_[i], .duration_s = duration_s(i)};
    visit(*this, increment, wheels_, [&](const auto& column, auto& member, auto) {
      if (!column.empty()) member = column[i];
    });
    return increment;
  }
  [[nodiscard]] Increment front() const { return (*this)[0]; }
  [[nodiscard]] Increment back() const { return (*this)[size() - 1]; }
  [[nodiscard]] Iterator begin() const;
  [[nodiscard]] Iterator end() const;

  void reserve(std::size_t increments);
  void push_back(const Increment& increment);
  /// Its stamp and its duration stay.
  void set(std::size_t i, const Increment& increment);
  void set_gyro_change(std::size_t i, double change_rad_s);
  /// Leaves those from `first` on before `end`.
  void cut(std::size_t first, std::size_t end);

 private:
  /// Each column of those that may be missing, its member, and what that usually is.
  template <class Columns, class Value, class Visitor>
  static void visit(Columns& columns, Value&& increment, std::size_t wheels, const Visitor& visitor) {
    constexpr Increment kUsual;
    visitor(columns.scrub_turned_, increment.scrub_turned, kUsual.scrub_turned);
    visitor(columns.gyro_rad_, increment.gyro_rad, kUsual.gyro_rad);
    visitor(columns.has_gyro_, increment.has_gyro, kUsual.has_gyro);
    visitor(columns.gyro_change_rad_s_, increment.gyro_change_rad_s, kUsual.gyro_change_rad_s);
    visitor(columns.shaking_m_s2_, increment.shaking_m_s2, kUsual.shaking_m_s2);
    for (std::size_t w = 0; w < wheels; ++w) {
      visitor(columns.turned_[w], increment.turned[w], kUsual.turned[w]);
      visitor(columns.speed_turned_[w], increment.speed_turned[w], kUsual.speed_turned[w]);
      visitor(columns.slip_variance_[w], increment.slip_variance[w], kUsual.slip_variance[w]);
      visitor(columns.steering_rad_[w], increment.steering_rad[w], kUsual.steering_rad[w]);
    }
  }
  double between(std::size_t i) const { return i == 0 ? first_duration_s_ : time_s_[i] - time_s_[i - 1]; }
  void count_wheels();

  using Numbers = SparseColumn<double>;
  std::vector<double> time_s_;
  double first_duration_s_ = 0.0;
  Numbers duration_s_;
  std::array<Numbers, kMaxWheels> turned_;
  Numbers scrub_turned_;
  std::array<Numbers, kMaxWheels> speed_turned_;
  Numbers gyro_rad_;
  SparseColumn<bool> has_gyro_;
  Numbers gyro_change_rad_s_;
  std::array<Numbers, kMaxWheels> slip_variance_;
  std::array<Numbers, kMaxWheels> steering_rad_;
  Numbers shaking_m_s2_;
  std::size_t wheels_ = 0;  ///< that have a column, and those before them
};

/// Gives each increment as a value.
class Increments::Iterator {
 public:
  using iterator_concept = std::random_access_iterator_tag;
  using iterator_category = std::input_iterator_tag;  // of old, a reference is expected of the others
  using value_type = Increment;
  using difference_type = std::ptrdiff_t;
  using pointer = void;
  using reference = Increment;

  Iterator() = default;
  Iterator(const Increments& increments, std::size_t i)
      : increments_(&increments), i_(static_cast<difference_type>(i)) {}

  Increment operator*() const { return (*increments_)[static_cast<std::size_t>(i_)]; }
  Increment operator[](difference_type n) const { return *(*this + n); }
  Iterator& operator+=(difference_type n) { return i_ += n, *this; }
  Iterator& operator-=(difference_type n) { return i_ -= n, *this; }
  Iterator& operator++() { return ++i_, *this; }
  Iterator& operator--() { return --i_, *this; }
  Iterator operator++(int) {
    const Iterator before = *this;
    ++i_;
    return before;
  }
  Iterator operator--(int) {
    const Iterator before = *this;
    --i_;
    return before;
  }
  friend Iterator operator+(Iterator at, difference_type n) { return at += n; }
  friend Iterator operator+(difference_type n, Iterator at) { return at += n; }
  friend Iterator operator-(Iterator at, difference_type n) { return at -= n; }
  friend difference_type operator-(const Iterator& a, const Iterator& b) { return a.i_ - b.i_; }
  bool operator==(const Iterator& other) const { return i_ == other.i_; }
  auto operator<=>(const Iterator& other) const { return i_ <=> other.i_; }

 private:
  const Increments* increments_ = nullptr;
  difference_type i_ = 0;
};

inline Increments::Iterator Increments::begin() const {
  return {*this, 0};
}
inline Increments::Iterator Increments::end() const {
  return {*this, size()};
}

/// Increments one after another, of those that must outlive it.
class IncrementRange {
 public:
  IncrementRange(const Increments& increments) : IncrementRange(increments, 0, increments.size()) {}
  IncrementRange(const Increments& increments, std::size_t first, std::size_t end)
      : begin_(increments, first), end_(increments, end) {}

  [[nodiscard]] Increments::Iterator begin() const { return begin_; }
  [[nodiscard]] Increments::Iterator end() const { return end_; }

 private:
  Increments::Iterator begin_, end_;
};

/// The median of their durations [s]; of an even number the shorter one in the middle. 0 without any.
[[nodiscard]] double usual_interval_s(const Increments& increments);

}  // namespace trundle::recording
