#pragma once

#include <cstddef>
#include <optional>

#include "trundle/recording/finding.hpp"
#include "trundle/recording/turns.hpp"

namespace trundle::calibration {

/// Turns that wheel of the robot round, and says so: a column in ticks counts the other way, another one is
/// of a wheel that rolls the other way.
Finding turn_around(std::size_t wheel, bool in_ticks, Robot& robot);

/// The wheel that counts backwards, as the gyro shows: counted the other way it turns the robot as its gyro
/// does. `turns`: by all wheels as they are, and by the gyro. Nothing where these agree, or where no one
/// wheel explains why not.
[[nodiscard]] std::optional<std::size_t> reversed_wheel(const PairedSums& turns,
                                                        const AlignedReadings& readings, const Robot& robot);

/// Whether turns have one sense and about one size; where wheels scrub, one sense.
[[nodiscard]] bool turns_agree(const PairedSums& turns, const Robot& robot);

}  // namespace trundle::calibration
