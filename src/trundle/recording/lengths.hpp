#pragma once

#include "trundle/recording/recording.hpp"

namespace trundle::recording {

/// Throws InputError where a column of a stream has another length than its stamps, as one that somebody left
/// empty who filled a Recording by hand: what was not measured is NaN.
void require_equal_lengths(const Recording& recording);
void require_equal_lengths(const ReferenceStream& reference);

}  // namespace trundle::recording
