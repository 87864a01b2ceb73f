#include "trundle/pipeline/drafting/detail/candidates.hpp"

#include <algorithm>

#include "trundle/pipeline/drafting/detail/sensors.hpp"

namespace trundle::pipeline {

using logs::FieldSummary;
using logs::TopicSummary;

const FieldSummary* field_of(const TopicSummary& topic, std::string_view path) {
  const auto found = std::ranges::find(topic.fields, path, &FieldSummary::path);
  return found == topic.fields.end() || found->is_text || found->values == 0 ? nullptr : &*found;
}

bool is_wanted_only(const std::vector<std::string>& words) {
  return has_word(
      words, {"setpoint", "setpoints", "desired", "target", "goal", "command", "cmd", "covariance", "error",
              "joystick", "auto", "optimized", "bias", "wheel", "max", "min"});
}

DraftStream stream_of(const char* table, const TopicSummary& topic, std::string reason) {
  DraftStream stream{.table = table, .file = {}, .topic = topic.topic};
  stream.reason = std::move(reason);
  return stream;
}

void put_best_first(std::vector<DraftStream>& streams, const DraftQuestion& question,
                    const std::function<double(const DraftStream&, const TopicSummary&)>& merit) {
  std::ranges::stable_sort(streams, std::ranges::greater(), [&](const DraftStream& stream) {
    const auto topic = std::ranges::find(question.summary.topics, stream.topic, &TopicSummary::topic);
    return topic == question.summary.topics.end() ? 0.0 : merit(stream, *topic);
  });
}

void drop_unstamped(std::vector<DraftStream>& streams, const DraftQuestion& question) {
  if (!question.is_csv) return;
  std::erase_if(streams, [&](const DraftStream& stream) {
    const auto table = std::ranges::find(question.summary.topics, stream.topic, &TopicSummary::topic);
    return table == question.summary.topics.end() || !stamps_of(*table);
  });
}

}  // namespace trundle::pipeline
