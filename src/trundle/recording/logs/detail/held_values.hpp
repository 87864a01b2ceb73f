#pragma once

#include "trundle/recording/csv/detail/streams.hpp"

namespace trundle::recording {

/// Of a log in which a value stands only where it changes: adds the rows in which nothing changed, so that a
/// rest is a rest and no gap, and motion begins where it did. A rate holds until the next: as the mean since
/// the row before it stands one row later. Appends to `findings` what was added.
void hold_between_changes(StreamKind kind, const StreamSource& source, Table& rows,
                          std::vector<Finding>& findings);

}  // namespace trundle::recording
