// ULog of PX4: definitions of messages, then messages that name a subscription; fields without padding but
// that which their definition names. https://docs.px4.io/main/en/dev_log/ulog_file_format.html
#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/logs/definitions.hpp"
#include "trundle/logs/detail/byte_cursor.hpp"
#include "trundle/logs/detail/file_window.hpp"
#include "trundle/logs/detail/formats.hpp"

namespace trundle::logs {
namespace {

constexpr std::size_t kUlogHead = 16;       // magic, version, time
constexpr std::size_t kUlogRecordHead = 3;  // size, type
constexpr std::int64_t kMicrosecond_ns = 1000;
constexpr std::array kSyncMagic = {std::byte{0x2f}, std::byte{0x73}, std::byte{0x13}, std::byte{0x20},
                                   std::byte{0x25}, std::byte{0x0c}, std::byte{0xbb}, std::byte{0x12}};
constexpr std::size_t kUlogScan = 1 << 16;  ///< how far it looks for the next sync at once [bytes]

using UlogDefinitions = std::map<std::string, std::string, std::less<>>;  ///< "type name;…" by message

struct UlogType {
  std::string_view name;
  FieldType type;
};
constexpr std::array<UlogType, 12> kUlogTypes = {{{"int8_t", FieldType::int8},
                                                  {"uint8_t", FieldType::uint8},
                                                  {"int16_t", FieldType::int16},
                                                  {"uint16_t", FieldType::uint16},
                                                  {"int32_t", FieldType::int32},
                                                  {"uint32_t", FieldType::uint32},
                                                  {"int64_t", FieldType::int64},
                                                  {"uint64_t", FieldType::uint64},
                                                  {"float", FieldType::float32},
                                                  {"double", FieldType::float64},
                                                  {"bool", FieldType::boolean},
                                                  {"char", FieldType::character}}};

/// The structures of a message, the outermost last.
class UlogStructures {
 public:
  explicit UlogStructures(const UlogDefinitions& definitions) : definitions_(definitions) {}

  std::uint32_t add(std::string_view name) {
    if (const auto known = index_of_.find(name); known != index_of_.end()) return known->second;
    const auto definition = definitions_.find(name);
    if (definition == definitions_.end())
      throw BadDefinition(fmt::format("the log does not define '{}'", name));
    if (!open_.emplace(name).second) throw BadDefinition(fmt::format("'{}' contains itself", name));
    if (open_.size() > Layout::kDeepest) throw BadDefinition("messages nest too deep");
    LayoutStructure structure{.name = std::string(name), .fields = {}};
    std::string_view rest = definition->second;
    while (!rest.empty()) {
      const std::size_t end = std::min(rest.find(';'), rest.size());
      if (end > 0) structure.fields.push_back(field_in(rest.substr(0, end)));
      rest.remove_prefix(std::min(end + 1, rest.size()));
    }
    open_.erase(open_.find(name));
    structures_.push_back(std::move(structure));
    const auto index = static_cast<std::uint32_t>(structures_.size() - 1);
    index_of_.emplace(name, index);
    return index;
  }
  std::vector<LayoutStructure> take() { return std::move(structures_); }

 private:
  /// "float[3] xyz".
  LayoutField field_in(std::string_view text) {
    const std::size_t gap = text.find(' ');
    if (gap == std::string_view::npos) throw BadDefinition(fmt::format("'{}' is no field", text));
    std::string_view type = text.substr(0, gap);
    LayoutField field{.name = std::string(text.substr(gap + 1))};
    field.is_padding = field.name.starts_with("_padding");
    if (const std::size_t open = type.find('['); open != std::string_view::npos) {
      field.arity = FieldArity::fixed;
      field.count = count_in_brackets(type.substr(open), text);
      type = type.substr(0, open);
    }
    for (const UlogType& known : kUlogTypes) {
      if (known.name != type) continue;
      field.type = known.type;
      // A text has a length, be it 1.
      if (field.type == FieldType::character) field.arity = FieldArity::fixed;
      return field;
    }
    field.type = FieldType::structure;
    field.structure = add(type);
    return field;
  }

  static std::uint32_t count_in_brackets(std::string_view brackets, std::string_view text) {
    std::uint32_t count = 0;
    for (const char digit : brackets.substr(1, brackets.size() - 2)) {
      if (digit < '0' || digit > '9' || count > kMostElements)
        throw BadDefinition(fmt::format("'{}' is no field", text));
      count = 10 * count + static_cast<std::uint32_t>(digit - '0');
    }
    if (!brackets.ends_with(']') || count == 0) throw BadDefinition(fmt::format("'{}' is no field", text));
    return count;
  }
  static constexpr std::uint32_t kMostElements = 1 << 16;  ///< a message is shorter than that

  const UlogDefinitions& definitions_;
  std::vector<LayoutStructure> structures_;
  std::map<std::string, std::uint32_t, std::less<>> index_of_;
  std::set<std::string, std::less<>> open_;
};

/// Padding at the end of a message is not written; within it is.
Layout layout_of_ulog(std::string_view name, const UlogDefinitions& definitions) {
  UlogStructures structures(definitions);
  structures.add(name);
  std::vector<LayoutStructure> all = structures.take();
  std::vector<LayoutField>& fields = all.back().fields;
  while (!fields.empty() && fields.back().is_padding) fields.pop_back();
  return Layout(std::move(all));
}

/// Whether its messages begin with their time.
bool is_stamped(const Layout& layout) {
  const std::vector<LayoutField>& fields = layout.root().fields;
  return !fields.empty() && fields[0].name == "timestamp" && fields[0].type == FieldType::uint64;
}

class UlogLog final : public Log {
 public:
  UlogLog(const std::filesystem::path& path, const Limits& limits) : file_(path), limits_(limits) {
    if (file_.peek(kUlogHead).size() < kUlogHead)
      throw InputError(path.string(), "ends within the head of a ULog", "a whole head");
    ByteCursor head(file_.peek(kUlogHead));
    head.take_bytes(8);
    if (const auto start_us = head.take<std::uint64_t>(); start_us <= kLatest_us)
      time_ns_ = static_cast<std::int64_t>(start_us) * kMicrosecond_ns;
    file_.skip(kUlogHead);
    read_definitions();
  }

  std::string_view format() const override { return "ULog"; }
  std::span<const Channel* const> channels() const override { return channels_.all(); }
  const std::optional<Cut>& cut() const override { return cut_; }
  std::span<const Loss> losses() const override { return losses_; }

  std::optional<Message> next() override {
    while (const std::optional<Record> record = next_record()) {
      if (record->type == 'F') define(text_of(record->bytes));
      if (record->type == 'A') subscribe(record->bytes);
      if (record->type == 'R') subscriptions_.erase(ByteCursor(record->bytes).take<std::uint16_t>());
      if (record->type != 'D') continue;
      ByteCursor cursor(record->bytes);
      const auto subscription = subscriptions_.find(cursor.take<std::uint16_t>());
      if (!cursor.is_good() || subscription == subscriptions_.end()) continue;
      take_time(*subscription->second, cursor.rest());
      return Message{subscription->second, time_ns_, cursor.rest()};
    }
    return std::nullopt;
  }

 private:
  static constexpr std::uint64_t kLatest_us = kLatestTime_ns / kMicrosecond_ns;

  struct Record {
    char type = 0;
    std::span<const std::byte> bytes;
  };

  void end_here(std::string_view reason) {
    cut_ = Cut{file_.path().string(), file_.position(), std::string(reason)};
  }

  /// The record at the front, not passed; nothing at the end or at a cut.
  std::optional<Record> peek_record() {
    while (!cut_ && left() > 0) {
      const std::span<const std::byte> head = file_.peek(kUlogRecordHead);
      ByteCursor cursor(head);
      const auto size = cursor.take<std::uint16_t>();
      const auto type = cursor.take<char>();
      const std::size_t whole = kUlogRecordHead + size;
      if (left() < whole && passes_to_appended()) continue;
      if (!cursor.is_good() || file_.left() < whole) {
        end_here("the file ends within a message");
        return std::nullopt;
      }
      // No message is empty, and none has a type that is no letter: the damage lasts to the next sync.
      if (size == 0 || type < 'A' || type > 'Z') {
        find_sync();
        continue;
      }
      return Record{type, file_.peek(whole).subspan(kUlogRecordHead)};
    }
    if (!cut_ && passes_to_appended()) return peek_record();
    return std::nullopt;
  }

  std::optional<Record> next_record() {
    const std::optional<Record> record = peek_record();
    if (record) file_.skip(kUlogRecordHead + record->bytes.size());  // the bytes stay until the next peek
    return record;
  }

  /// Bytes to the end, or to what was appended after a crash: there the messages of before may break off.
  std::uint64_t left() const {
    if (appended_.empty() || appended_.front() >= file_.size()) return file_.left();
    return appended_.front() > file_.position() ? appended_.front() - file_.position() : 0;
  }

  bool passes_to_appended() {
    if (appended_.empty() || appended_.front() >= file_.size()) return false;
    file_.seek(appended_.front());
    appended_.erase(appended_.begin());
    return true;
  }

  void find_sync() {
    const std::uint64_t from = file_.position();
    while (file_.left() > 0) {
      const std::span<const std::byte> bytes = file_.peek(kUlogScan + kSyncMagic.size());
      const auto sync = std::search(bytes.begin(), bytes.end(), kSyncMagic.begin(), kSyncMagic.end());
      if (sync != bytes.end()) {
        file_.skip(static_cast<std::uint64_t>(sync - bytes.begin()) + kSyncMagic.size());
        break;
      }
      file_.skip(bytes.size() == file_.left() ? bytes.size() : kUlogScan);
    }
    const std::uint64_t lost = file_.position() - from;
    if (file_.left() == 0) {
      file_.seek(from);
      end_here(fmt::format("the last {} bytes hold no whole message", lost));
    } else if (losses_.size() < kMostLosses) {
      losses_.push_back({from, lost});
    } else {
      losses_.back().bytes += lost;
    }
  }

  /// All before the first subscription or message that is logged: the flags, and what messages are like.
  void read_definitions() {
    while (const std::optional<Record> record = peek_record()) {
      if (record->type == 'A' || record->type == 'D' || record->type == 'L') return;
      if (record->type == 'B') take_flags(record->bytes);
      if (record->type == 'F') define(text_of(record->bytes));
      file_.skip(kUlogRecordHead + record->bytes.size());
    }
  }

  void take_flags(std::span<const std::byte> bytes) {
    ByteCursor cursor(bytes);
    cursor.take_bytes(8);  // what a reader may ignore
    const std::span<const std::byte> incompatible = cursor.take_bytes(8);
    std::array<std::uint64_t, 3> offsets{};
    for (std::uint64_t& offset : offsets) offset = cursor.take<std::uint64_t>();
    if (!cursor.is_good()) return;
    for (std::size_t i = 0; i < incompatible.size(); ++i)
      if ((incompatible[i] & (i == 0 ? std::byte{0xfe} : std::byte{0xff})) != std::byte{0})
        throw InputError(file_.path().string(), "is a ULog with a flag that says it cannot be read without",
                         "no flag but that of appended data");
    if ((incompatible[0] & std::byte{1}) == std::byte{0}) return;
    std::uint64_t previous = file_.position();
    for (const std::uint64_t offset : offsets)
      if (offset > previous) appended_.push_back(previous = offset);
  }

  /// "name:type field;type field;".
  void define(std::string_view text) {
    const std::size_t colon = text.find(':');
    if (colon == std::string_view::npos) return;
    definition_bytes_ += text.size();
    if (definitions_.size() >= limits_.most_channels || definition_bytes_ > limits_.all_definitions) {
      end_here("it defines more messages than any");
      return;
    }
    definitions_.insert_or_assign(std::string(text.substr(0, colon)), std::string(text.substr(colon + 1)));
  }

  void subscribe(std::span<const std::byte> bytes) {
    ByteCursor cursor(bytes);
    const auto instance = cursor.take<std::uint8_t>();
    const auto id = cursor.take<std::uint16_t>();
    if (!cursor.is_good()) return;
    const std::string name(text_of(cursor.rest()));
    Channel channel;
    channel.id = id;
    channel.topic = instance == 0 ? name : fmt::format("{}[{}]", name, instance);
    channel.type = name;
    Channel*& same = by_topic_[channel.topic];
    if (same == nullptr) {
      if (channels_.size() == limits_.most_channels) {
        end_here(fmt::format("it holds more than {} topics", limits_.most_channels));
        return;
      }
      try {
        channel.layout = layout_of_ulog(name, definitions_);
        channel.encoding = Encoding::packed;
        channel.has_time = is_stamped(*channel.layout);
        channel.definition = definitions_.find(name)->second;
      } catch (const BadDefinition&) {  // layout_of() says that there is none
      }
      same = &channels_.add(std::move(channel));
    }
    subscriptions_[id] = same;
  }

  void take_time(const Channel& channel, std::span<const std::byte> fields) {
    if (!channel.layout || !is_stamped(*channel.layout)) return;
    ByteCursor cursor(fields);
    const auto time_us = cursor.take<std::uint64_t>();
    if (cursor.is_good() && time_us <= kLatest_us)
      time_ns_ = static_cast<std::int64_t>(time_us) * kMicrosecond_ns;
  }

  FileWindow file_;
  Limits limits_;
  ChannelList channels_;
  UlogDefinitions definitions_;
  std::size_t definition_bytes_ = 0;
  std::map<std::string, Channel*> by_topic_;
  std::unordered_map<std::uint16_t, Channel*> subscriptions_;
  std::vector<std::uint64_t> appended_;  ///< where data were appended, not yet reached
  std::int64_t time_ns_ = 0;             ///< of the last message
  std::vector<Loss> losses_;
  std::optional<Cut> cut_;
};

}  // namespace

std::unique_ptr<Log> open_ulog(const std::filesystem::path& path, const Limits& limits) {
  return std::make_unique<UlogLog>(path, limits);
}

}  // namespace trundle::logs
