#pragma once

#include <string>

#include "trundle/recording/csv/detail/toml_reader.hpp"
#include "trundle/recording/recording.hpp"
#include "trundle/recording/reference_noise.hpp"

namespace trundle::recording {

/// The partial references among the keys of a [reference] table. Throws InputError.
PartialReference read_partial_reference(TomlReader& table);

/// What the same table states of the trajectory's noise; the heading in degrees or in radians.
ReferenceSigmas read_reference_noise(TomlReader& table);

/// The same keys as text, to be read back with the same bits.
std::string to_toml(const PartialReference& partial);

}  // namespace trundle::recording
