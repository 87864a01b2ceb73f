#pragma once

#include "trundle/recording/csv/detail/streams.hpp"

namespace trundle::recording {

/// Of a log in which a value stands only where it changes: adds the rows in which nothing changed, so that a
/// rest is a rest and no gap, and motion begins where it did. What is written stays at its stamp, rates too:
/// it was measured in that cycle. Appends to `findings` what was added.
void hold_between_changes(StreamKind kind, const StreamSource& source, Table& rows,
                          std::vector<Finding>& findings);

}  // namespace trundle::recording
