#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "trundle/namespaces.hpp"

namespace trundle::recording {

/// The factor that turns numbers in `unit` into those of the stream's column, whose name carries its unit
/// ("x_m", "yaw_rate_rad_s"). Nothing when the unit is unknown or measures something else.
std::optional<double> factor_of(std::string_view unit, std::string_view column);

/// A unit that lengths are taken for metres in, by mistake: as it is called, and its symbol in
/// recording.toml.
struct LengthUnit {
  std::string_view name;
  std::string_view symbol;
};
inline constexpr LengthUnit kLengthUnits[] = {
    {"millimetres", "mm"}, {"centimetres", "cm"}, {"inches", "in"}, {"feet", "ft"}, {"kilometres", "km"}};

/// The units that a column may be given in, for messages.
std::string units_for(std::string_view column);

}  // namespace trundle::recording
