#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "trundle/pipeline/drafting/detail/names.hpp"
#include "trundle/pipeline/drafting/draft.hpp"

namespace trundle::pipeline {

// What the searches for all kinds of streams share.

/// A field of numbers that has some; nullptr: there is none.
[[nodiscard]] const logs::FieldSummary* field_of(const logs::TopicSummary& topic, std::string_view path);
/// By its name no measurement: what is wanted, or made of measurements.
[[nodiscard]] bool is_wanted_only(const std::vector<std::string>& words);
/// Of a topic; without columns.
[[nodiscard]] DraftStream stream_of(const char* table, const logs::TopicSummary& topic, std::string reason);
/// Sorts by the merit of each with its topic, the greatest first.
void put_best_first(std::vector<DraftStream>& streams, const DraftQuestion& question,
                    const std::function<double(const DraftStream&, const logs::TopicSummary&)>& merit);
/// Tables without stamps hold no stream.
void drop_unstamped(std::vector<DraftStream>& streams, const DraftQuestion& question);

}  // namespace trundle::pipeline
