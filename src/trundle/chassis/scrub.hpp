#pragma once

#include <array>

#include "trundle/chassis/chassis.hpp"

namespace trundle::chassis {

/// Whether its track may depend on how sharply it turns: skid wheels on two sides, none that is steered.
[[nodiscard]] bool can_scrub(const Chassis& chassis);

/// +1 for skid wheels on the right, −1 for those on the left, 0 for all others and where nothing scrubs.
[[nodiscard]] std::array<double, kMaxWheels> scrub_sides(const Chassis& chassis);

/// Half of how much further the skid wheels on the right turned than those on the left, as Increment::turned.
[[nodiscard]] double half_difference(const Chassis& chassis, const std::array<double, kMaxWheels>& turned);

/// How sharp a turn is of which wheels read that: 0 straight ahead, ½ about the wheels of one side, 1 on the
/// spot. docs/theory/scrub.md, eq. 1.
[[nodiscard]] double sharpness(double left_turned, double right_turned);

/// What the turns of the wheels amount to on the ground, and which turns amount to that: of an interval in
/// which all turn evenly. docs/theory/scrub.md, eq. 2.
[[nodiscard]] std::array<double, kMaxWheels> without_scrub(const Chassis& chassis,
                                                           const std::array<double, kMaxWheels>& turned);
[[nodiscard]] std::array<double, kMaxWheels> with_scrub(const Chassis& chassis,
                                                        const std::array<double, kMaxWheels>& turned);

/// What a ScrubGauge remembers: plain numbers.
struct ScrubState {
  double left = 0.0;  ///< revolutions, those of long ago forgotten
  double right = 0.0;

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.left, self.right);
  }
};

/// Fills in Increment::scrub_turned. How sharp a turn is shows in the last millimetres that the wheels
/// rolled: in a single interval the rounding of counts would hide it. docs/theory/scrub.md, eq. 3. Its
/// functions never allocate.
class ScrubGauge {
 public:
  explicit ScrubGauge(const Chassis& chassis);

  /// Nothing to fill in otherwise.
  [[nodiscard]] bool applies() const { return applies_; }
  /// Of intervals in their order.
  void add(ScrubState& state, Increment& increment) const;

 private:
  bool applies_ = false;
  std::size_t wheels_ = 0;
  std::array<double, kMaxWheels> left_{};  ///< shares of the mean turn of each side
  std::array<double, kMaxWheels> right_{};
  double memory_ = 0.0;  ///< [revolutions], of both sides together
};

}  // namespace trundle::chassis
