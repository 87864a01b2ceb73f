#include "trundle/pipeline/log_answer.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "trundle/io/words.hpp"

namespace trundle::pipeline {
namespace {

using LogJson = nlohmann::ordered_json;
namespace fs = std::filesystem;

LogJson json_of(const logs::TopicSummary& topic) {
  LogJson json = {{"topic", topic.topic}, {"type", topic.type}, {"messages", topic.messages}};
  if (topic.messages > 0) {
    json["start_s"] = static_cast<double>(topic.start_ns) * logs::kNanosecond_s;
    json["end_s"] = static_cast<double>(topic.end_ns) * logs::kNanosecond_s;
  }
  if (topic.rate_hz > 0.0) {
    json["rate_hz"] = topic.rate_hz;
    json["gaps"] = topic.gaps;
    json["longest_step_s"] = topic.longest_step_s;
  }
  if (topic.stamp_lag)
    json["stamp_lag"] = {{"mean_s", topic.stamp_lag->mean_s},
                         {"least_s", topic.stamp_lag->least_s},
                         {"most_s", topic.stamp_lag->most_s}};
  if (topic.unreadable.empty())
    json["fields"] = topic.paths;
  else
    json["unreadable"] = topic.unreadable;
  if (!topic.metadata.empty()) json["metadata"] = topic.metadata;
  return json;
}

}  // namespace

std::vector<InputFile> inputs_of_log(const fs::path& log) {
  if (!fs::is_directory(log)) return {input_file(log)};
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(log))
    if (entry.is_regular_file()) files.push_back(entry.path());
  std::ranges::sort(files);
  std::vector<InputFile> inputs;
  for (const fs::path& file : files) inputs.push_back(input_file(file));
  return inputs;
}

LogAnswer answer_log(const LogQuestion& question) {
  LogAnswer answer;
  answer.log = question.log;
  const std::unique_ptr<logs::Log> log = logs::open_log(question.log);
  answer.summary = logs::survey(*log, {}, logs::Definitions(question.message_folders));
  add_inputs(inputs_of_log(question.log), answer.provenance);
  return answer;
}

std::optional<LogSpan> span_of(const logs::LogSummary& summary) {
  std::optional<LogSpan> span;
  // What comes once tells when something was set, be it long before the log or, as in PX4, at no time at all.
  const auto lasts = [](const logs::TopicSummary& topic) { return topic.has_time && topic.messages > 1; };
  const bool any_lasts = std::ranges::any_of(summary.topics, lasts);
  for (const logs::TopicSummary& topic : summary.topics) {
    if (topic.messages == 0 || (any_lasts && !lasts(topic))) continue;
    const double start_s = static_cast<double>(topic.start_ns) * logs::kNanosecond_s;
    const double end_s = static_cast<double>(topic.end_ns) * logs::kNanosecond_s;
    if (!span) span = LogSpan{start_s, end_s};
    span->start_s = std::min(span->start_s, start_s);
    span->end_s = std::max(span->end_s, end_s);
  }
  return span;
}

LogJson document_of(const LogAnswer& answer) {
  LogJson document = to_json(answer.provenance);
  const logs::LogSummary& summary = answer.summary;
  document["log"] = answer.log.string();
  document["format"] = summary.format;
  document["written_on_change"] = summary.is_written_on_change;
  if (const auto span = span_of(summary)) {
    document["start_s"] = span->start_s;
    document["end_s"] = span->end_s;
  }
  if (summary.cut)
    document["cut"] = {
        {"file", summary.cut->place}, {"byte", summary.cut->byte}, {"reason", summary.cut->reason}};
  document["losses"] = LogJson::array();
  for (const logs::Loss& loss : summary.losses)
    document["losses"].push_back({{"byte", loss.byte}, {"bytes", loss.bytes}});
  document["topics"] = LogJson::array();
  for (const logs::TopicSummary& topic : summary.topics) document["topics"].push_back(json_of(topic));
  return document;
}

std::vector<std::string> faults_of(const logs::LogSummary& summary) {
  std::vector<std::string> faults;
  if (summary.cut && summary.cut->byte > 0)
    faults.push_back(fmt::format("{}: byte {}: {}: what is before it is used", summary.cut->place,
                                 summary.cut->byte, summary.cut->reason));
  else if (summary.cut)
    faults.push_back(
        fmt::format("{}: {}: what is before it is used", summary.cut->place, summary.cut->reason));
  for (const logs::Loss& loss : summary.losses)
    faults.push_back(fmt::format("byte {}: {} that hold no message are passed over", loss.byte,
                                 counted(loss.bytes, "byte")));
  return faults;
}

}  // namespace trundle::pipeline
