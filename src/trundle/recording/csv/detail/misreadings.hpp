#pragma once

#include <span>
#include <vector>

#include "trundle/recording/csv/detail/table.hpp"

namespace trundle::recording {

/// Stamps that cannot be seconds. Throws InputError, with the time_unit to write, where recording.toml maps
/// the stream; else it is a problem.
void check_stamps(const Table& table, const StreamSource& source, const RowRules& rules,
                  std::vector<Finding>& findings);

/// Counts since the row before that were taken for a counter that goes on, or the other way round.
void check_increments(const WheelStream& wheels, const StreamSource& source, std::vector<Finding>& findings);

/// Headings that go beyond whole turns, and by more than half a turn from row to row, are degrees. Of the
/// cells as they are in the file.
void check_headings(std::span<const double> headings, const StreamSource& source,
                    std::vector<Finding>& findings);

/// Bearings that cannot be radians.
void check_bearings(const std::vector<Sighting>& sightings, const StreamSource& source,
                    std::vector<Finding>& findings);

}  // namespace trundle::recording
