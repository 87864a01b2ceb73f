#include "trundle/recording/logs/detail/transforms.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <span>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "trundle/io/error.hpp"
#include "trundle/recording/logs/detail/log_streams.hpp"

namespace trundle::recording {
namespace {

/// tf of ROS 1 writes a slash before the names of frames, tf2 none.
std::string frame_name(std::string_view name) {
  if (name.starts_with('/')) name.remove_prefix(1);
  return std::string(name);
}

constexpr std::array kTransformNumbers = {"translation.x", "translation.y", "translation.z", "rotation.x",
                                          "rotation.y",    "rotation.z",    "rotation.w"};

/// A tree of frames by the parent of each.
using FrameTree = std::map<std::string, StampedTransform, std::less<>>;

/// From a frame to the root: its own steps. One that leads back is a circle: it ends there.
std::vector<TransformStep> steps_up(const FrameTree& tree, std::string frame) {
  std::vector<TransformStep> steps;
  std::set<std::string> seen;
  for (auto at = tree.find(frame); at != tree.end() && seen.insert(frame).second; at = tree.find(frame)) {
    steps.push_back({at->second.parent, frame});
    frame = at->second.parent;
  }
  return steps;
}

/// Up from one frame to where the ways meet, and down to the other; nothing: they do not meet.
std::optional<std::vector<TransformStep>> steps_between(const FrameTree& tree, const std::string& from,
                                                        const std::string& to) {
  std::vector<TransformStep> up = steps_up(tree, from), down = steps_up(tree, to);
  const std::string root_of_from = up.empty() ? from : up.back().parent;
  if (root_of_from != (down.empty() ? to : down.back().parent)) return std::nullopt;
  while (!up.empty() && !down.empty() && up.back().child == down.back().child) {
    up.pop_back();
    down.pop_back();
  }
  for (TransformStep& step : up) step.is_inverse = true;
  up.insert(up.end(), down.rbegin(), down.rend());
  if (up.empty()) return std::nullopt;
  return up;
}

/// The first transform of each child, until they connect two frames; all of them where they do not.
FrameTree tree_of(const FramePair& frames) {
  FrameTree tree;
  TransformReader reader(frames.topic);
  const auto log = logs::open_log(frames.log);
  while (const std::optional<logs::Message> message = log->next()) {
    bool is_new = false;
    for (StampedTransform& transform : reader.read(*message, frames.log.string())) {
      const std::string child = transform.child;
      is_new = tree.try_emplace(child, std::move(transform)).second || is_new;
    }
    if (is_new && steps_between(tree, frames.from, frames.to)) break;
  }
  return tree;
}

[[noreturn]] void refuse(const FramePair& frames, const FrameTree& tree, std::string_view what) {
  constexpr std::size_t kMostNames = 12;  // more would make a list of the message
  std::vector<std::string> pairs;
  for (const auto& [child, transform] : tree) pairs.push_back(transform.parent + " -> " + child);
  const bool is_more = pairs.size() > kMostNames;
  pairs.resize(std::min(pairs.size(), kMostNames));
  throw InputError(
      frames.place,
      fmt::format("'{}' and '{}' are not connected by the {}transforms of {}", frames.from, frames.to, what,
                  frames.topic),
      pairs.empty() ? "a topic with transforms"
                    : fmt::format("frames of one tree: {}{}", fmt::join(pairs, ", "), is_more ? ", …" : ""));
}

/// The product of static transforms along the steps; nothing: one of them is not static.
std::optional<Eigen::Isometry3d> static_pose(const FrameTree& tree, std::span<const TransformStep> steps) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  for (const TransformStep& step : steps) {
    const StampedTransform& transform = tree.find(step.child)->second;
    if (!transform.is_static) return std::nullopt;
    pose = pose * (step.is_inverse ? transform.pose.inverse() : transform.pose);
  }
  return pose;
}

Eigen::Isometry3d pose_of(const Eigen::Vector3d& translation, const Eigen::Quaterniond& rotation) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translate(translation);
  pose.rotate(rotation);
  return pose;
}

}  // namespace

struct TransformReader::Readers {
  logs::FieldReader parent, child, stamp;
  std::vector<logs::FieldReader> numbers;
  bool is_static = false;
};

const TransformReader::Readers* TransformReader::readers_of(const logs::Channel& channel,
                                                            const std::string& file) {
  const auto known = readers_.find(&channel);
  if (known != readers_.end()) return known->second.get();
  std::shared_ptr<Readers>& mine = readers_[&channel];
  const bool is_static = channel.topic == topic_ + "_static" || channel.topic == "/tf_static";
  if (channel.topic != topic_ && !is_static) return nullptr;
  try {
    const logs::Layout layout = logs::layout_of(channel);
    const auto reader = [&](const std::string& path) {
      return logs::FieldReader(layout, channel.encoding, "transforms[]." + path);
    };
    mine = std::make_shared<Readers>(
        Readers{reader("header.frame_id"), reader("child_frame_id"), reader("header.stamp"), {}, is_static});
    for (const char* const number : kTransformNumbers)
      mine->numbers.push_back(reader(std::string("transform.") + number));
  } catch (const logs::BadDefinition& error) {
    throw InputError(file, fmt::format("{}: {}", channel.topic, error.what()),
                     "messages whose definition is known");
  } catch (const logs::UnknownField& error) {
    throw InputError(file, fmt::format("{} is no topic of transforms: {}", channel.topic, error.what()),
                     "a tf2_msgs/TFMessage");
  }
  return mine.get();
}

std::vector<StampedTransform> TransformReader::read(const logs::Message& message, const std::string& file) {
  std::vector<StampedTransform> transforms;
  const Readers* const readers = readers_of(*message.channel, file);
  if (readers == nullptr) return transforms;
  const auto all = [&](const logs::FieldReader& reader) {
    std::vector<logs::Value> values;
    reader.read_all(message, values);
    return values;
  };
  const std::vector<logs::Value> parents = all(readers->parent), children = all(readers->child),
                                 stamps = all(readers->stamp);
  std::array<std::vector<logs::Value>, kTransformNumbers.size()> numbers;
  for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] = all(readers->numbers[i]);
  for (std::size_t k = 0; k < numbers.back().size(); ++k) {  // the last field: of the others none is missing
    std::array<double, kTransformNumbers.size()> n{};
    for (std::size_t i = 0; i < n.size(); ++i) n[i] = logs::number_of(numbers[i][k]).value_or(kNotMeasured);
    const Eigen::Quaterniond rotation(n[6], n[3], n[4], n[5]);
    const Eigen::Vector3d translation(n[0], n[1], n[2]);
    if (!translation.allFinite() || !(rotation.squaredNorm() > 0.0) || !rotation.coeffs().allFinite())
      continue;
    const auto* const stamp = std::get_if<std::int64_t>(&stamps[k]);
    transforms.push_back({frame_name(std::get<std::string_view>(parents[k])),
                          frame_name(std::get<std::string_view>(children[k])),
                          stamp != nullptr ? *stamp : message.log_time_ns, message.log_time_ns,
                          pose_of(translation, rotation.normalized()), readers->is_static});
  }
  return transforms;
}

std::vector<TransformStep> find_transforms(const FramePair& given) {
  FramePair frames = given;
  frames.from = frame_name(given.from);
  frames.to = frame_name(given.to);
  const FrameTree tree = tree_of(frames);
  std::optional<std::vector<TransformStep>> steps = steps_between(tree, frames.from, frames.to);
  if (!steps) refuse(frames, tree, "");
  return std::move(*steps);
}

std::array<double, 3> vertical_in_sensor(const FramePair& given) {
  FramePair frames = given;
  frames.from = frame_name(given.from);
  frames.to = frame_name(given.to);
  if (frames.from == frames.to) return {0.0, 0.0, 1.0};
  const FrameTree tree = tree_of(frames);
  const std::optional<std::vector<TransformStep>> steps = steps_between(tree, frames.from, frames.to);
  if (!steps) refuse(frames, tree, "");
  const std::optional<Eigen::Isometry3d> body_from_sensor = static_pose(tree, *steps);
  if (!body_from_sensor) refuse(frames, tree, "static ");
  const Eigen::Matrix3d rotation = body_from_sensor->linear();
  return {rotation(2, 0), rotation(2, 1), rotation(2, 2)};
}

std::optional<Mounting> mounting_of(const std::filesystem::path& log, const std::string& topic) {
  const std::string sensor = frame_of_topic(log, topic);
  if (sensor.empty()) return std::nullopt;
  const FrameTree tree = tree_of({log, "/tf", {}, {}, {}});  // no pair: the whole tree
  for (const char* const body : {"base_link", "base_footprint"}) {
    if (sensor == body) return Mounting{body};
    const auto steps = steps_between(tree, body, sensor);
    const auto pose = steps ? static_pose(tree, *steps) : std::nullopt;
    if (pose) return Mounting{body, *pose};
  }
  return std::nullopt;
}

std::string frame_of_topic(const std::filesystem::path& path, const std::string& topic) {
  const auto log = logs::open_log(path);
  while (const std::optional<logs::Message> message = log->next()) {
    if (message->channel->topic != topic) continue;
    try {
      const logs::FieldReader reader(logs::layout_of(*message->channel), message->channel->encoding,
                                     "header.frame_id");
      const logs::Value value = reader.read(*message);
      const auto* const text = std::get_if<std::string_view>(&value);
      return text == nullptr ? std::string() : frame_name(*text);
    } catch (const logs::BadDefinition&) {
      return {};
    } catch (const logs::UnknownField&) {
      return {};
    }
  }
  return {};
}

TransformStream::TransformStream(const StreamSource& source)
    : source_(source), reader_(source.topic), series_(source.transforms.size()) {}

void TransformStream::take(const logs::Message& message) {
  const bool by_log_time = source_.time && source_.time->name == "log_time";
  for (const StampedTransform& transform : reader_.read(message, source_.file.string()))
    for (std::size_t i = 0; i < series_.size(); ++i) {
      const TransformStep& step = source_.transforms[i];
      if (transform.parent != step.parent || transform.child != step.child) continue;
      series_[i].is_static = series_[i].is_static && transform.is_static;
      if (transform.is_static) series_[i].samples.clear();  // the last holds
      series_[i].samples.push_back({by_log_time ? transform.log_time_ns : transform.stamp_ns,
                                    transform.log_time_ns, transform.pose.translation(),
                                    Eigen::Quaterniond(transform.pose.linear())});
    }
}

std::optional<std::int64_t> TransformStream::first_stamp() const {
  for (const Series& series : series_)
    if (!series.is_static && !series.samples.empty()) return series.samples.front().time_ns;
  return std::nullopt;
}

std::optional<Eigen::Isometry3d> TransformStream::interpolated(const Series& series, std::int64_t time_ns) {
  const std::vector<Sample>& samples = series.samples;
  if (samples.empty()) return std::nullopt;
  if (series.is_static) return pose_of(samples.front().translation, samples.front().rotation);
  const auto after = std::ranges::lower_bound(samples, time_ns, {}, &Sample::time_ns);
  if (after == samples.end()) return std::nullopt;
  if (after->time_ns == time_ns) return pose_of(after->translation, after->rotation);
  if (after == samples.begin()) return std::nullopt;
  const Sample& before = *std::prev(after);
  const double share =
      static_cast<double>(time_ns - before.time_ns) / static_cast<double>(after->time_ns - before.time_ns);
  return pose_of(before.translation + share * (after->translation - before.translation),
                 before.rotation.slerp(share, after->rotation));
}

std::optional<Eigen::Isometry3d> TransformStream::pose_at(std::int64_t time_ns) const {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  for (std::size_t i = 0; i < series_.size(); ++i) {
    const std::optional<Eigen::Isometry3d> step = interpolated(series_[i], time_ns);
    if (!step) return std::nullopt;
    pose = pose * (source_.transforms[i].is_inverse ? step->inverse() : *step);
  }
  return pose;
}

Table TransformStream::finish(std::vector<Finding>& findings) {
  const Series* fastest = nullptr;
  for (Series& series : series_) {
    std::ranges::stable_sort(series.samples, {}, &Sample::time_ns);
    const bool is_more = fastest == nullptr || series.samples.size() > fastest->samples.size();
    if (!series.is_static && is_more) fastest = &series;
  }
  const std::string frames = fmt::format("'{}' and '{}'", source_.frames.front(), source_.frames.back());
  if (fastest == nullptr)
    throw InputError(source_.place, fmt::format("the frames {} do not move against each other", frames),
                     "frames between which a transform is published while the robot drives");
  Table table;
  table.origin = {fmt::format("{} {}", source_.file.string(), source_.topic), {}, source_.time_offset_s};
  table.numbers.resize(source_.columns.size());
  table.texts.resize(source_.columns.size());
  std::vector<std::int64_t> stamps, log_times;
  for (std::size_t row = 0; row < fastest->samples.size(); ++row) {
    const Sample& sample = fastest->samples[row];
    const std::optional<Eigen::Isometry3d> pose = pose_at(sample.time_ns);
    if (!pose) continue;
    stamps.push_back(sample.time_ns);
    log_times.push_back(sample.log_time_ns);
    table.origin.lines.append(row + 1);
    table.time_s.push_back(seconds_of(sample.time_ns, source_.time_scale.origin_s) + source_.time_offset_s);
    const Eigen::Quaterniond q(pose->linear());
    const std::map<std::string_view, double> values = {{"x_m", pose->translation().x()},
                                                       {"y_m", pose->translation().y()},
                                                       {"qx", q.x()},
                                                       {"qy", q.y()},
                                                       {"qz", q.z()},
                                                       {"qw", q.w()}};
    for (std::size_t i = 0; i < source_.columns.size(); ++i) {
      const auto value = values.find(source_.columns[i].column);
      table.numbers[i].push_back(value == values.end() ? kNotMeasured : value->second);
    }
  }
  if (table.time_s.empty())
    throw InputError(source_.place,
                     fmt::format("the transforms between {} are never there at the same time", frames),
                     "transforms whose stamps overlap");
  if (!source_.time) findings.push_back(finding_of_stamps(stamps, log_times, table.origin.file));
  return table;
}

}  // namespace trundle::recording
