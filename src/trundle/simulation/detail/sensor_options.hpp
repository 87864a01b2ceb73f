#pragma once

#include "trundle/simulation/detail/scenario_keys.hpp"

namespace trundle::simulation::scenario_file {

/// Reads [key], whose other keys `others` reads.
template <class T, std::size_t n, class Others>
void read_options(const Section& outer, std::string_view key, std::vector<std::string> other_names,
                  const std::array<NumberKey<T>, n>& keys, T& target, Others others) {
  const auto section = table(outer, key, fmt::format("[{}]", key));
  if (!section) return;
  check_keys(*section, names_with(std::move(other_names), keys));
  read_numbers(*section, keys, target);
  others(*section);
}

/// The sections that both the file and a single run can have.
const std::vector<std::string>& sensor_sections();
/// Reads them; what they do not say stays as it is.
void read_sensors(const Section& outer, Scenario& scenario, Pace& pace);

/// [landmarks] at random and [[landmark]] by name.
std::vector<Landmark> read_landmarks(const Section& file, std::uint64_t seed);

}  // namespace trundle::simulation::scenario_file
