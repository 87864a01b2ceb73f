#include "trundle/recording/csv/detail/partial_reference.hpp"

#include <cmath>

#include <fmt/format.h>

#include "trundle/recording/csv/reader.hpp"

namespace trundle::recording {
namespace {

/// Below it nothing is known, and the squares of what is divided by it leave a double.
constexpr double kSmallestSigma = 1e-12;

std::optional<double> value_in(TomlReader& table, const std::string& key) {
  const auto value = table.number(key);
  if (value && std::abs(*value) > kLargestReading)
    table.fail(key, fmt::format("{} is {}", key, *value), "a number between -1e9 and 1e9");
  return value;
}

std::optional<double> sigma_in(TomlReader& table, const std::string& key) {
  const auto sigma = table.number_above_zero(key);
  if (sigma && (*sigma < kSmallestSigma || *sigma > kLargestReading))
    table.fail(key, fmt::format("{} is {}", key, *sigma), "a number between 1e-12 and 1e9");
  return sigma;
}

std::optional<Measured> measured_in(TomlReader& table, const std::string& key, double default_sigma,
                                    double factor = 1.0) {
  const auto value = value_in(table, key);
  const auto sigma = sigma_in(table, key + "_sigma");
  if (sigma && !value) table.fail(key + "_sigma", fmt::format("gives {0}_sigma without {0}", key), key);
  if (!value) return std::nullopt;
  return Measured{*value * factor, sigma ? *sigma * factor : default_sigma};
}

/// The same angle may be given in degrees or in radians.
std::optional<Measured> angle_in(TomlReader& table, const std::string& key) {
  const auto in_radians = measured_in(table, key + "_rad", kDefaultHeadingSigma);
  const auto in_degrees = measured_in(table, key + "_deg", kDefaultHeadingSigma, radians(1.0));
  if (in_radians && in_degrees)
    table.fail(key + "_deg", fmt::format("gives {0}_rad and {0}_deg", key), "one of them");
  return in_radians ? in_radians : in_degrees;
}

void take_closed(TomlReader& table, PartialReference& partial) {
  const bool closed = table.boolean("closed").value_or(false);
  const bool heading = table.boolean("closed_heading").value_or(closed);
  const auto sigma_m = sigma_in(table, "closed_sigma_m");
  const auto sigma_deg = sigma_in(table, "closed_sigma_deg");
  const auto sigma_rad = sigma_in(table, "closed_sigma_rad");
  if (sigma_m && !closed)
    table.fail("closed_sigma_m", "gives closed_sigma_m without closed = true", "closed = true");
  if ((sigma_deg || sigma_rad) && !heading)
    table.fail(sigma_deg ? "closed_sigma_deg" : "closed_sigma_rad",
               "gives a sigma of a heading that is not closed", "closed = true or closed_heading = true");
  if (closed) partial.closed = Measured{0.0, sigma_m.value_or(kDefaultPositionSigma)};
  if (heading)
    partial.closed_heading = Measured{0.0, sigma_rad   ? *sigma_rad
                                           : sigma_deg ? radians(*sigma_deg)
                                                       : kDefaultHeadingSigma};
}

}  // namespace

PartialReference read_partial_reference(TomlReader& table) {
  PartialReference partial;
  take_closed(table, partial);
  partial.distance_m = measured_in(table, "distance_m", kDefaultPositionSigma);
  if (partial.distance_m && partial.distance_m->value < 0.0)
    table.fail("distance_m", "distance_m is negative", "a number of at least 0");
  partial.turns = measured_in(table, "turns", kDefaultHeadingSigma / (2.0 * kPi));
  partial.end_x_m = measured_in(table, "end_x_m", kDefaultPositionSigma);
  partial.end_y_m = measured_in(table, "end_y_m", kDefaultPositionSigma);
  partial.end_heading_rad = angle_in(table, "end_heading");
  return partial;
}

ReferenceSigmas read_reference_noise(TomlReader& table) {
  const auto sigma_m = sigma_in(table, "position_sigma_m");
  const auto sigma_deg = sigma_in(table, "heading_sigma_deg");
  const auto sigma_rad = sigma_in(table, "heading_sigma_rad");
  if (sigma_deg && sigma_rad)
    table.fail("heading_sigma_deg", "gives heading_sigma_rad and heading_sigma_deg", "one of them");
  return {sigma_m.value_or(0.0), sigma_deg ? radians(*sigma_deg) : sigma_rad.value_or(0.0)};
}

std::string to_toml(const ReferenceSigmas& noise) {
  std::string text;
  if (noise.position_sigma_m > 0.0) text += fmt::format("position_sigma_m = {}\n", noise.position_sigma_m);
  if (noise.heading_sigma_rad > 0.0) text += fmt::format("heading_sigma_rad = {}\n", noise.heading_sigma_rad);
  return text;
}

std::string to_toml(const PartialReference& partial) {
  std::string text;
  const auto add = [&](const char* key, const std::optional<Measured>& measured) {
    if (measured) text += fmt::format("{0} = {1}\n{0}_sigma = {2}\n", key, measured->value, measured->sigma);
  };
  if (partial.closed) text += fmt::format("closed = true\nclosed_sigma_m = {}\n", partial.closed->sigma);
  if (partial.closed || partial.closed_heading)
    text += fmt::format("closed_heading = {}\n", partial.closed_heading.has_value());
  if (partial.closed_heading) text += fmt::format("closed_sigma_rad = {}\n", partial.closed_heading->sigma);
  add("distance_m", partial.distance_m);
  add("turns", partial.turns);
  add("end_x_m", partial.end_x_m);
  add("end_y_m", partial.end_y_m);
  add("end_heading_rad", partial.end_heading_rad);
  return text;
}

}  // namespace trundle::recording
