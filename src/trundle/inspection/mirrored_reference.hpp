#pragma once

#include "trundle/recording/recording.hpp"

namespace trundle::inspection {

/// Whether the path of a reference bends the other way than its headings turn, as it does where x and y are
/// swapped, or one of them counts the other way. For robots that roll where they look.
bool is_mirrored(const ReferenceStream& reference);

}  // namespace trundle::inspection
