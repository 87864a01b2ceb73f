// ArduPilot's DataFlash log: messages of two magic bytes, a type, and fields without padding, which messages
// FMT lay out (type, length, name, a character for each field, names of fields); FMTU, UNIT and MULT give
// units. https://ardupilot.org/copter/docs/common-logs.html, libraries/AP_Logger/LogStructure.h
#include <algorithm>
#include <array>
#include <map>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "trundle/logs/detail/byte_cursor.hpp"
#include "trundle/logs/detail/file_window.hpp"
#include "trundle/logs/detail/formats.hpp"

namespace trundle::logs {
namespace {

constexpr std::array kSync = {std::byte{0xa3}, std::byte{0x95}};
constexpr std::size_t kDataFlashHead = 3;  // sync and type
constexpr std::uint8_t kFormatType = 128;  // of the message FMT, which lays itself out, too
constexpr std::size_t kFormatLength = 89;
constexpr std::size_t kTypes = 256;  // one byte names them
/// So many zeros, or bytes of ones, are no numbers of a message but memory that holds nothing.
constexpr std::size_t kErased = 64;
/// How far it looks for the next message at once [bytes].
constexpr std::size_t kScan = 1 << 16;

struct FieldCharacter {
  char character;
  FieldType type;
  std::uint32_t count = 1;  ///< above 1: an array, or text
  double scale = 1.0;
};
constexpr std::array<FieldCharacter, 21> kFieldCharacters = {{
    {'a', FieldType::int16, 32},      {'b', FieldType::int8},
    {'B', FieldType::uint8},          {'h', FieldType::int16},
    {'H', FieldType::uint16},         {'i', FieldType::int32},
    {'I', FieldType::uint32},         {'f', FieldType::float32},
    {'d', FieldType::float64},        {'n', FieldType::character, 4},
    {'N', FieldType::character, 16},  {'Z', FieldType::character, 64},
    {'c', FieldType::int16, 1, 0.01}, {'C', FieldType::uint16, 1, 0.01},
    {'e', FieldType::int32, 1, 0.01}, {'E', FieldType::uint32, 1, 0.01},
    {'L', FieldType::int32, 1, 1e-7}, {'M', FieldType::uint8},
    {'q', FieldType::int64},          {'Q', FieldType::uint64},
    {'g', FieldType::float16},
}};

const FieldCharacter* field_character(char character) {
  const auto found = std::ranges::find(kFieldCharacters, character, &FieldCharacter::character);
  return found == kFieldCharacters.end() ? nullptr : &*found;
}

std::size_t size_of(const FieldCharacter& field) {
  switch (field.type) {
    case FieldType::int16:
    case FieldType::uint16:
    case FieldType::float16:
      return 2 * field.count;
    case FieldType::int32:
    case FieldType::uint32:
    case FieldType::float32:
      return 4 * field.count;
    case FieldType::int64:
    case FieldType::uint64:
    case FieldType::float64:
      return 8 * field.count;
    default:
      return field.count;
  }
}

std::string_view fixed_text(std::span<const std::byte> bytes) {
  const std::string_view text = text_of(bytes);
  return text.substr(0, text.find('\0'));
}

/// What FMT says of a type.
struct MessageFormat {
  std::size_t length = 0;  ///< of the message with its head; 0: no FMT yet
  std::string name;
  std::string characters;
  std::vector<std::string> labels;
  std::string units = {}, multipliers = {};  ///< of FMTU: a character for each field

  /// What a field is called that has no label.
  std::string label(std::size_t field) const {
    return field < labels.size() && !labels[field].empty() ? labels[field] : fmt::format("field{}", field);
  }
  /// From the front of the message's fields; nothing: there is no such field.
  std::optional<std::size_t> offset_of(std::size_t wanted) const {
    std::size_t offset = 0;
    for (std::size_t field = 0; field < characters.size(); ++field) {
      if (field == wanted) return offset;
      offset += size_of(*field_character(characters[field]));
    }
    return std::nullopt;
  }
};

/// Nothing: it does not describe a message.
std::optional<MessageFormat> format_in(std::span<const std::byte> fields) {
  ByteCursor cursor(fields);
  cursor.take<std::uint8_t>();  // the type
  MessageFormat format;
  format.length = cursor.take<std::uint8_t>();
  format.name = fixed_text(cursor.take_bytes(4));
  format.characters = fixed_text(cursor.take_bytes(16));
  std::string_view labels = fixed_text(cursor.take_bytes(64));
  std::size_t size = kDataFlashHead;
  for (const char character : format.characters) {
    const FieldCharacter* const known = field_character(character);
    if (known == nullptr) return std::nullopt;
    size += size_of(*known);
  }
  if (!cursor.is_good() || size != format.length || format.name.empty()) return std::nullopt;
  while (!labels.empty()) {
    const std::size_t comma = std::min(labels.find(','), labels.size());
    format.labels.emplace_back(labels.substr(0, comma));
    labels.remove_prefix(std::min(comma + 1, labels.size()));
  }
  return format;
}

/// Where the time stands, and how many nanoseconds it counts.
struct TimeField {
  std::size_t offset = 0;
  FieldType type = FieldType::uint64;
  std::int64_t tick_ns = 0;
};

/// Only the first field is of the log's own clock; the GPS of old logs has the satellites' there, its own is
/// T.
std::optional<TimeField> time_field_of(const MessageFormat& format) {
  const auto of_field = [&](std::size_t field, std::int64_t tick_ns) -> std::optional<TimeField> {
    const FieldType type = field_character(format.characters[field])->type;
    if (type != FieldType::uint32 && type != FieldType::uint64 && type != FieldType::int64)
      return std::nullopt;
    return TimeField{*format.offset_of(field), type, tick_ns};
  };
  // What TimeUS counts, and what GMS and TimeMS count.
  constexpr std::int64_t kMicro_ns = 1'000, kMilli_ns = 1'000'000;
  if (format.characters.empty()) return std::nullopt;
  if (format.label(0) == "TimeUS") return of_field(0, kMicro_ns);
  if (format.name == "GPS" || format.name == "GPS2")
    for (std::size_t field = 0; field < format.characters.size(); ++field)
      if (format.label(field) == "T") return of_field(field, kMilli_ns);
  return format.label(0) == "TimeMS" ? of_field(0, kMilli_ns) : std::nullopt;
}

class DataFlashLog final : public Log {
 public:
  DataFlashLog(const std::filesystem::path& path, const Limits& limits) : file_(path), limits_(limits) {
    Type& own = types_[kFormatType];
    own.format = {kFormatLength, "FMT", "BBnNZ", {"Type", "Length", "Name", "Format", "Columns"}};
  }

  std::string_view format() const override { return "DataFlash"; }
  std::span<const Channel* const> channels() const override { return channels_.all(); }
  const std::optional<Cut>& cut() const override { return cut_; }
  std::span<const Loss> losses() const override { return losses_; }

  std::optional<Message> next() override {
    while (!cut_ && file_.left() > 0) {
      const std::span<const std::byte> head = file_.peek(kDataFlashHead);
      if (!starts_message(head)) {
        find_message();
        continue;
      }
      const auto id = std::to_integer<std::uint8_t>(head[2]);
      Type& type = types_[id];
      const std::span<const std::byte> piece = file_.peek(type.format.length + kErased);
      if (piece.size() < type.format.length) return end_here("the file ends within a message");
      const std::span<const std::byte> bytes = piece.first(type.format.length);
      if (!may_follow(piece.subspan(bytes.size()))) {
        find_message();
        continue;
      }
      file_.skip(bytes.size());
      const std::span<const std::byte> fields = bytes.subspan(kDataFlashHead);
      take_time(type, fields);
      if (id == kFormatType)
        take_format(fields);
      else if (type.format.name == "FMTU")
        take_units(type.format, fields);
      else if (type.format.name == "UNIT")
        take_letter(type.format, fields, units_);
      else if (type.format.name == "MULT")
        take_letter(type.format, fields, multipliers_);
      Channel* const channel = channel_of(id, fields);
      if (channel == nullptr) return std::nullopt;
      return Message{channel, time_ns_, fields};
    }
    return std::nullopt;
  }

 private:
  struct Type {
    MessageFormat format;
    std::optional<TimeField> time = {};
    std::optional<std::size_t> instance_at = {};  ///< the byte that tells sensors of one kind apart
    std::vector<Channel*> channels = {};          ///< by instance
  };

  std::nullopt_t end_here(std::string_view reason) {
    cut_ = Cut{file_.path().string(), file_.position(), std::string(reason)};
    return std::nullopt;
  }

  bool starts_message(std::span<const std::byte> head) const {
    return head.size() >= kDataFlashHead && head[0] == kSync[0] && head[1] == kSync[1] &&
           types_[std::to_integer<std::uint8_t>(head[2])].format.length > 0;
  }

  /// What stands behind a message that lacks no byte: the next one, be it of a type whose FMT is lost, erased
  /// memory, or the end of the file.
  static bool may_follow(std::span<const std::byte> head) {
    const auto is_erased = [](std::byte byte) { return byte == std::byte{0} || byte == std::byte{0xff}; };
    return head.size() < kDataFlashHead || (head[0] == kSync[0] && head[1] == kSync[1]) ||
           std::ranges::all_of(head, is_erased);
  }

  /// Whether a message stands there and another one, or the end of the file, follows: two magic bytes alone
  /// may well stand among damaged ones.
  bool are_messages(std::span<const std::byte> bytes, bool is_end) const {
    if (!starts_message(bytes)) return false;
    const std::size_t length = types_[std::to_integer<std::uint8_t>(bytes[2])].format.length;
    if (bytes.size() == length) return is_end;
    if (bytes.size() < length + kDataFlashHead) return false;
    return starts_message(bytes.subspan(length));
  }

  /// Passes what is no message. Where only erased memory follows, the log ends as it should.
  void find_message() {
    const std::uint64_t from = file_.position();
    constexpr std::size_t kFollowing = kTypes + kDataFlashHead;  // a message of any length and the next head
    bool is_erased = true;
    while (file_.left() > 0) {
      const std::span<const std::byte> bytes = file_.peek(kScan + kFollowing);
      const bool is_end = bytes.size() == file_.left();
      const std::size_t tried = is_end ? bytes.size() : kScan;
      std::size_t at = 0;
      while (at < tried && !are_messages(bytes.subspan(at), is_end)) {
        is_erased = is_erased && (bytes[at] == std::byte{0} || bytes[at] == std::byte{0xff});
        ++at;
      }
      file_.skip(at);
      if (at < tried) break;
    }
    if (file_.left() == 0 && is_erased) return;
    if (file_.left() == 0) {
      cut_ = Cut{file_.path().string(), from,
                 fmt::format("the last {} bytes hold no whole message", file_.position() - from)};
    } else if (losses_.size() < kMostLosses) {
      losses_.push_back({from, file_.position() - from});
    } else {
      losses_.back().bytes += file_.position() - from;
    }
  }

  void take_time(const Type& type, std::span<const std::byte> fields) {
    if (!type.time) return;
    ByteCursor cursor(fields.subspan(type.time->offset));
    const std::uint64_t ticks =
        type.time->type == FieldType::uint32 ? cursor.take<std::uint32_t>() : cursor.take<std::uint64_t>();
    if (ticks <= kLatestTime_ns / static_cast<std::uint64_t>(type.time->tick_ns))
      time_ns_ = static_cast<std::int64_t>(ticks) * type.time->tick_ns;
  }

  /// Of one type the same again means nothing; another (logs written behind each other) begins anew.
  void take_format(std::span<const std::byte> fields) {
    const auto id = std::to_integer<std::uint8_t>(fields[0]);
    const std::optional<MessageFormat> format = format_in(fields);
    if (!format || id == kFormatType) return;
    Type& type = types_[id];
    const MessageFormat& old = type.format;
    if (old.length == format->length && old.name == format->name && old.characters == format->characters &&
        old.labels == format->labels)
      return;
    type = {.format = *format, .time = time_field_of(*format)};
  }

  /// The field of that name, from its first byte on.
  static ByteCursor field_of(const MessageFormat& format, std::span<const std::byte> fields,
                             std::string_view label) {
    for (std::size_t field = 0; field < format.characters.size(); ++field)
      if (format.label(field) == label) return ByteCursor(fields.subspan(*format.offset_of(field)));
    return ByteCursor({});
  }

  void take_units(const MessageFormat& format, std::span<const std::byte> fields) {
    Type& type = types_[field_of(format, fields, "FmtType").take<std::uint8_t>()];
    if (type.format.length == 0) return;
    type.format.units = fixed_text(field_of(format, fields, "UnitIds").take_bytes(16));
    type.format.multipliers = fixed_text(field_of(format, fields, "MultIds").take_bytes(16));
    const std::size_t instance = type.format.units.find('#');
    if (instance >= type.format.characters.size()) return;
    if (size_of(*field_character(type.format.characters[instance])) == 1)
      type.instance_at = type.format.offset_of(instance);
  }

  /// UNIT and MULT: a letter, and what it stands for.
  static void take_letter(const MessageFormat& format, std::span<const std::byte> fields,
                          std::map<char, std::string>& letters) {
    const char letter = field_of(format, fields, "Id").take<char>();
    if (format.name == "MULT")
      letters[letter] = fmt::format("{}", field_of(format, fields, "Mult").take<double>());
    else
      letters[letter] = fixed_text(field_of(format, fields, "Label").take_bytes(64));
  }

  /// Of a number as this program gives it: "deg", "1e-06 s"; empty: not known.
  std::string unit_of(const MessageFormat& format, std::size_t field) const {
    const auto meaning = [&](const std::map<char, std::string>& letters, const std::string& of_fields) {
      const auto found = field < of_fields.size() ? letters.find(of_fields[field]) : letters.end();
      return found == letters.end() ? std::string() : found->second;
    };
    const std::string unit = meaning(units_, format.units);
    const std::string multiplier = meaning(multipliers_, format.multipliers);
    const bool is_scaled = field_character(format.characters[field])->scale != 1.0;
    if (unit.empty() || is_scaled || multiplier.empty() || multiplier == "0" || multiplier == "1")
      return unit;
    return multiplier + ' ' + unit;
  }

  Layout layout_of(const MessageFormat& format) const {
    std::vector<LayoutField> fields;
    for (std::size_t i = 0; i < format.characters.size(); ++i) {
      const FieldCharacter& character = *field_character(format.characters[i]);
      LayoutField field{.name = format.label(i), .type = character.type};
      if (character.count > 1) field.arity = FieldArity::fixed;
      field.count = character.count;
      field.scale = character.scale;
      field.unit = unit_of(format, i);
      fields.push_back(std::move(field));
    }
    return Layout({{.name = format.name, .fields = std::move(fields)}});
  }

  /// That of the type, or of the instance that the message is of; nothing: they are too many.
  Channel* channel_of(std::uint8_t id, std::span<const std::byte> fields) {
    Type& type = types_[id];
    const std::size_t instance =
        type.instance_at ? std::to_integer<std::size_t>(fields[*type.instance_at]) : 0;
    if (type.channels.size() <= instance) type.channels.resize(instance + 1);
    Channel*& channel = type.channels[instance];
    if (channel != nullptr) return channel;
    if (channels_.size() == limits_.most_channels) {
      end_here(fmt::format("it holds more than {} kinds of messages", limits_.most_channels));
      return nullptr;
    }
    const std::string& name = type.format.name;
    Channel made;
    made.id = id;
    made.topic = type.instance_at ? fmt::format("{}[{}]", name, instance) : name;
    made.type = name;
    made.has_time = type.time.has_value();
    made.encoding = Encoding::packed;
    made.layout = layout_of(type.format);
    channel = &channels_.add(std::move(made));
    return channel;
  }

  FileWindow file_;
  Limits limits_;
  ChannelList channels_;
  std::array<Type, kTypes> types_;
  std::map<char, std::string> units_, multipliers_;  ///< by their letters
  std::int64_t time_ns_ = 0;                         ///< of the last message that had one
  std::vector<Loss> losses_;
  std::optional<Cut> cut_;
};

}  // namespace

std::unique_ptr<Log> open_dataflash(const std::filesystem::path& path, const Limits& limits) {
  return std::make_unique<DataFlashLog>(path, limits);
}

}  // namespace trundle::logs
