#include "trundle/logs/survey.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <unordered_map>

#include "trundle/logs/field_reader.hpp"

namespace trundle::logs {
namespace {

// A gap: as in a recording no value is interpolated across it, and a slow topic is not all gaps.
constexpr double kShortestGap_s = 0.5;
constexpr double kGapInMedians = 5.0;              // steps
constexpr std::size_t kMostFieldsOfAll = 1 << 17;  // more than any robot has, and some 30 MB

/// Steps of time, of which only how many are about as long as each other is kept: eight classes from one
/// length to its double, so a median is known to 5 %, and exactly where steps are regular.
class Steps {
 public:
  void add(double step_s) {
    ++count_;
    longest_s_ = std::max(longest_s_, step_s);
    Class& mine = classes_[class_of(step_s)];
    ++mine.count;
    mine.sum_s += step_s;
  }
  double median_s() const {
    std::uint64_t below = 0;
    for (const auto& [length, mine] : classes_)
      if ((below += mine.count) * 2 >= count_) return mine.sum_s / static_cast<double>(mine.count);
    return 0.0;
  }
  std::uint64_t longer_than(double step_s) const {
    std::uint64_t found = 0;
    for (auto mine = classes_.upper_bound(class_of(step_s)); mine != classes_.end(); ++mine)
      found += mine->second.count;
    return found;
  }
  double longest_s() const { return longest_s_; }

 private:
  struct Class {
    std::uint64_t count = 0;
    double sum_s = 0.0;
  };
  static int class_of(double step_s) {
    constexpr double kPerDouble = 8.0;  // classes: a median is right to 9 %
    constexpr double kLeast_s = 1e-9;   // what stamps are given in
    return static_cast<int>(std::floor(kPerDouble * std::log2(std::max(step_s, kLeast_s))));
  }

  std::map<int, Class> classes_;
  std::uint64_t count_ = 0;
  double longest_s_ = 0.0;
};

/// The names beside the numbers of a message, as sensor_msgs/JointState has them.
struct Names {
  std::string array;  ///< "name"; empty: there are none
  std::vector<std::string_view> of;
};

/// A layout whose outermost structure has one array of texts and arrays of numbers beside it.
std::string names_array_in(const Layout& layout) {
  std::string found;
  bool has_numbers = false;
  for (const LayoutField& field : layout.root().fields) {
    if (field.arity != FieldArity::dynamic) continue;
    if (field.type == FieldType::string) {
      if (!found.empty()) return {};
      found = field.name;
    } else if (field.type == FieldType::float64 || field.type == FieldType::float32) {
      has_numbers = true;
    }
  }
  return has_numbers ? found : std::string();
}

/// "position[3]" as array and index; nothing: another path.
std::optional<std::pair<std::string_view, std::size_t>> element_in(std::string_view path) {
  const std::size_t open = path.find('[');
  if (open == std::string_view::npos || !path.ends_with(']')) return std::nullopt;
  std::size_t index = 0;
  for (const char digit : path.substr(open + 1, path.size() - open - 2)) {
    if (digit < '0' || digit > '9') return std::nullopt;
    index = 10 * index + static_cast<std::size_t>(digit - '0');
  }
  return std::pair(path.substr(0, open), index);
}

/// What is known so far of one channel.
class ChannelSurvey {
 public:
  /// `fields_left`: how many more fields all of them together may keep.
  ChannelSurvey(const Channel& channel, const SurveyOptions& options, std::size_t& fields_left)
      : options_(options), fields_left_(&fields_left) {
    summary_.topic = channel.topic;
    summary_.type = channel.type;
  }

  void add(const Message& message, const Definitions& definitions) {
    const Channel& channel = *message.channel;
    if (summary_.messages == 0 && !is_refused_) {
      refusal_ = fault_of_encapsulation(channel.encoding, message.bytes);
      is_refused_ = !refusal_.empty();
    }
    if (!layout_ && !is_refused_) take_layout(channel, definitions);
    take_time(message);
    if (!layout_) return;
    if (stamp_) take_stamp(message);
    if (options_.fields && message.bytes.size() <= options_.largest_message) take_fields(message);
  }

  bool is_finished() const { return is_finished_; }

  TopicSummary finish(const Channel& channel) {
    is_finished_ = true;
    summary_.metadata = channel.metadata;
    summary_.has_time = channel.has_time;
    if (!layout_ && summary_.unreadable.empty()) summary_.unreadable = refusal_;
    const double median_s = steps_.median_s();
    if (median_s > 0.0) {
      summary_.rate_hz = 1.0 / median_s;
      summary_.gaps = steps_.longer_than(std::max(kShortestGap_s, kGapInMedians * median_s));
    }
    summary_.longest_step_s = steps_.longest_s();
    if (stamps_ > 0) {
      lag_.mean_s /= static_cast<double>(stamps_);
      summary_.stamp_lag = lag_;
    }
    for (FieldSummary& field : fields_) summary_.fields.push_back(std::move(field));
    return std::move(summary_);
  }

 private:
  void take_layout(const Channel& channel, const Definitions& definitions) {
    try {
      layout_ = layout_of(channel, definitions);
      encoding_ = channel.encoding;
      names_.array = names_array_in(*layout_);
      summary_.paths = layout_->paths();
      stamp_ = stamp_in(*layout_);
    } catch (const BadDefinition& error) {
      refusal_ = error.what();
      // What cannot be laid out by its definition never can; what has none yet may get it.
      is_refused_ = !channel.definition.empty();
    }
  }

  std::optional<FieldReader> stamp_in(const Layout& layout) const {
    std::optional<FieldReader> stamp = reader_if_known(layout, encoding_, "header.stamp");
    if (stamp && !stamp->is_time()) stamp.reset();
    return stamp;
  }

  void take_time(const Message& message) {
    const std::int64_t now = message.log_time_ns;
    if (summary_.messages++ == 0) {
      summary_.start_ns = summary_.end_ns = now;
    } else if (now >= previous_ns_) {
      steps_.add(static_cast<double>(now - previous_ns_) * kNanosecond_s);
    }
    summary_.start_ns = std::min(summary_.start_ns, now);
    summary_.end_ns = std::max(summary_.end_ns, now);
    previous_ns_ = now;
  }

  void take_stamp(const Message& message) {
    const Value value = stamp_->read(message);
    const auto* const stamp_ns = std::get_if<std::int64_t>(&value);
    if (stamp_ns == nullptr || *stamp_ns == 0) return;
    const double lag_s =
        (static_cast<double>(message.log_time_ns) - static_cast<double>(*stamp_ns)) * kNanosecond_s;
    lag_.least_s = stamps_ == 0 ? lag_s : std::min(lag_.least_s, lag_s);
    lag_.most_s = stamps_ == 0 ? lag_s : std::max(lag_.most_s, lag_s);
    lag_.mean_s += lag_s;
    ++stamps_;
  }

  void take_fields(const Message& message) {
    names_.of.clear();
    const bool whole =
        visit(*layout_, encoding_, message.bytes,
              [&](std::string_view path, const Value& value) { take_field(named(path, value), value); });
    summary_.broken += whole ? 0 : 1;
  }

  /// An element by the name that stands beside it, where the names came before.
  std::string_view named(std::string_view path, const Value& value) {
    if (names_.array.empty()) return path;
    const auto element = element_in(path);
    if (!element) return path;
    const auto& [array, index] = *element;
    if (array == names_.array) {
      if (const auto* const text = std::get_if<std::string_view>(&value)) names_.of.push_back(*text);
      return path;
    }
    if (index >= names_.of.size()) return path;
    named_.assign(array);
    named_ += '[' + names_.array + '=';
    named_ += names_.of[index];
    named_ += ']';
    return named_;
  }

  void take_field(std::string_view path, const Value& value) {
    auto known = index_of_.find(path);
    if (known == index_of_.end()) {
      if (fields_.size() >= options_.most_fields || *fields_left_ == 0) return;
      --*fields_left_;
      fields_.push_back({.path = std::string(path)});
      known = index_of_.emplace(fields_.back().path, fields_.size() - 1).first;
    }
    FieldSummary& field = fields_[known->second];
    if (const auto* const text = std::get_if<std::string_view>(&value)) {
      constexpr std::size_t kLongestText = 256;  // to be looked at by a person
      field.is_text = true;
      ++field.values;
      if (field.text.empty()) field.text = text->substr(0, kLongestText);
      return;
    }
    if (const std::optional<double> number = number_of(value)) field.add(*number);
  }

  SurveyOptions options_;
  std::size_t* fields_left_;
  TopicSummary summary_;
  std::optional<Layout> layout_;
  Encoding encoding_ = Encoding::unknown;
  bool is_refused_ = false;
  bool is_finished_ = false;
  std::string refusal_ = "it has no message";
  std::optional<FieldReader> stamp_;
  TopicSummary::StampLag lag_;
  std::uint64_t stamps_ = 0;
  Steps steps_;
  std::int64_t previous_ns_ = 0;
  Names names_;
  std::string named_;
  std::deque<FieldSummary> fields_;
  std::map<std::string, std::size_t, std::less<>> index_of_;
};

/// Units that the format itself names, beside the fields that are values of the outermost structure.
void take_units(const Channel& channel, TopicSummary& topic) {
  if (!channel.layout) return;
  for (const LayoutField& of_layout : channel.layout->root().fields)
    for (FieldSummary& field : topic.fields)
      if (field.path == of_layout.name || field.path.starts_with(of_layout.name + '['))
        field.unit = of_layout.unit;
}

/// Several publishers of one topic are one: a bag gives each a channel of its own.
std::string key_of(const Channel& channel) {
  return channel.topic + '\0' + channel.type + '\0' + channel.definition;
}

}  // namespace

void FieldSummary::add(double number) {
  if (!std::isfinite(number)) return;
  if (values++ == 0) {
    first = least = most = last = number;
    return;
  }
  changes += number != last ? 1 : 0;
  falls += number < last ? 1 : 0;
  travel += std::abs(number - last);
  least = std::min(least, number);
  most = std::max(most, number);
  last = number;
}

LogSummary survey(Log& log, const SurveyOptions& options, const Definitions& definitions) {
  std::map<std::string, ChannelSurvey> surveys;
  std::unordered_map<const Channel*, ChannelSurvey*> survey_of_channel;
  std::size_t fields_left = kMostFieldsOfAll;
  const auto survey_of = [&](const Channel* channel) -> ChannelSurvey& {
    ChannelSurvey*& mine = survey_of_channel[channel];
    if (mine == nullptr)
      mine = &surveys.try_emplace(key_of(*channel), *channel, options, fields_left).first->second;
    return *mine;
  };
  while (const std::optional<Message> message = log.next())
    survey_of(message->channel).add(*message, definitions);
  LogSummary summary;
  summary.format = log.format();
  summary.is_written_on_change = log.is_written_on_change();
  for (const Channel* const channel : log.channels()) {
    ChannelSurvey& mine = survey_of(channel);
    if (mine.is_finished()) continue;
    summary.topics.push_back(mine.finish(*channel));
    take_units(*channel, summary.topics.back());
  }
  std::ranges::stable_sort(summary.topics, {}, &TopicSummary::topic);
  summary.cut = log.cut();
  summary.losses.assign(log.losses().begin(), log.losses().end());
  return summary;
}

}  // namespace trundle::logs
