#pragma once

#include <cstddef>
#include <optional>

#include "trundle/recording/turns.hpp"

namespace trundle::calibration {

/// The wheel that counts backwards, as the gyro shows: counted the other way it turns the robot as its gyro
/// does. `turns`: by all wheels as they are, and by the gyro. Nothing where these agree, or where no one
/// wheel explains why not.
[[nodiscard]] std::optional<std::size_t> reversed_wheel(const PairedSums& turns,
                                                        const AlignedReadings& readings, const Robot& robot);

/// Whether turns have one sense and about one size; where wheels scrub, one sense.
[[nodiscard]] bool turns_agree(const PairedSums& turns, const Robot& robot);

}  // namespace trundle::calibration
