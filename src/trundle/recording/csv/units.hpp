#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "trundle/namespaces.hpp"

namespace trundle::recording {

/// The factor that turns numbers in `unit` into those of the stream's column, whose name carries its unit
/// ("x_m", "yaw_rate_rad_s"). Nothing when the unit is unknown or measures something else.
std::optional<double> factor_of(std::string_view unit, std::string_view column);

/// The units that a column may be given in, for messages.
std::string units_for(std::string_view column);

}  // namespace trundle::recording
