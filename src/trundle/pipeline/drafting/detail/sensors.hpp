#pragma once

#include <string>
#include <vector>

#include "trundle/pipeline/drafting/draft.hpp"

namespace trundle::pipeline {

/// The candidates for a stream, the best first; without file.
[[nodiscard]] std::vector<DraftStream> gyro_candidates(const DraftQuestion& question);
[[nodiscard]] std::vector<DraftStream> reference_candidates(const DraftQuestion& question);
/// Sightings of tags, by the types of messages that detectors publish. Their cameras look along z, x to the
/// right.
[[nodiscard]] std::vector<DraftStream> sighting_candidates(const DraftQuestion& question);
/// Odometry that another program computed.
[[nodiscard]] std::vector<DraftStream> velocity_candidates(const DraftQuestion& question);
/// Angles of a gyro of which no rate is recorded.
[[nodiscard]] std::vector<DraftStream> gyro_headings(const DraftQuestion& question);

/// The stamps of a table: its column, and the unit as recording.toml names it. Nothing: no column rises.
struct StampColumn {
  std::string name;
  std::string unit;  ///< empty: seconds
};
[[nodiscard]] std::optional<StampColumn> stamps_of(const logs::TopicSummary& table);

}  // namespace trundle::pipeline
