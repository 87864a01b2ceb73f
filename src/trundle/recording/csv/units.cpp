#include "trundle/recording/csv/units.hpp"

#include <array>

#include "trundle/geometry/angle.hpp"

namespace trundle::recording {
namespace {

struct Unit {
  std::string_view name;
  std::string_view suffix;  ///< of the columns it can be given for
  double factor;
};

constexpr double kDegree = radians(1.0);
constexpr double kInch = 0.0254;              // [m], by definition, as the next two
constexpr double kFoot = 0.3048;              // [m], 12 inches
constexpr double kStandardGravity = 9.80665;  // [m/s²]

constexpr std::array kUnits = {
    Unit{"m", "_m", 1.0},
    Unit{"mm", "_m", 1e-3},
    Unit{"cm", "_m", 1e-2},
    Unit{"km", "_m", 1e3},
    Unit{"in", "_m", kInch},
    Unit{"ft", "_m", kFoot},
    Unit{"rad", "_rad", 1.0},
    Unit{"mrad", "_rad", 1e-3},
    Unit{"deg", "_rad", kDegree},
    Unit{"rev", "_rad", 2.0 * kPi},
    Unit{"rad/s", "_rad_s", 1.0},
    Unit{"deg/s", "_rad_s", kDegree},
    Unit{"rev/s", "_rad_s", 2.0 * kPi},
    Unit{"rpm", "_rad_s", 2.0 * kPi / 60.0},
    Unit{"m/s", "_m_s", 1.0},
    Unit{"mm/s", "_m_s", 1e-3},
    Unit{"cm/s", "_m_s", 1e-2},
    Unit{"km/h", "_m_s", 1.0 / 3.6},
    Unit{"in/s", "_m_s", kInch},
    Unit{"ft/s", "_m_s", kFoot},
    Unit{"m/s2", "_m_s2", 1.0},
    Unit{"m/s^2", "_m_s2", 1.0},
    Unit{"g", "_m_s2", kStandardGravity},
    Unit{"ticks", "_ticks", 1.0},
    Unit{"counts", "_ticks", 1.0},
};

}  // namespace

std::optional<double> factor_of(std::string_view unit, std::string_view column) {
  for (const Unit& known : kUnits)
    if (known.name == unit && column.ends_with(known.suffix)) return known.factor;
  return std::nullopt;
}

std::string units_for(std::string_view column) {
  std::string names;
  for (const Unit& known : kUnits)
    if (column.ends_with(known.suffix)) names += (names.empty() ? "" : ", ") + std::string(known.name);
  return names.empty() ? "no unit" : "one of " + names;
}

}  // namespace trundle::recording
