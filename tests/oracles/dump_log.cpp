// dump_log FILE [--quiet]: every field of every message of a log, a line each, to be compared with what other
// libraries read: "topic time_ns" and then " path=value", integers in decimal, floating-point numbers as
// their bits, text in hexadecimal. What cannot be decoded is the bytes of the message.
#include <bit>
#include <cstdio>
#include <map>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "trundle/logs/definitions.hpp"
#include "trundle/logs/field_reader.hpp"

namespace {

using namespace trundle::logs;

std::string hex(std::string_view bytes) {
  std::string text;
  for (const char c : bytes) text += fmt::format("{:02x}", static_cast<unsigned char>(c));
  return text;
}

std::string text_of_value(const Value& value) {
  if (const auto* const text = std::get_if<std::string_view>(&value)) return fmt::format("s{}", hex(*text));
  if (const auto* const number = std::get_if<double>(&value))
    return *number != *number ? "nan" : fmt::format("d{:016x}", std::bit_cast<std::uint64_t>(*number));
  if (const auto* const number = std::get_if<std::int64_t>(&value)) return fmt::format("{}", *number);
  return fmt::format("{}", std::get<std::uint64_t>(value));
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc < 2) return 2;
  const bool is_quiet = argc > 2;
  const auto log = open_log(argv[1]);
  std::map<const Channel*, std::optional<Layout>> layouts;
  std::size_t messages = 0, undecoded = 0;
  while (const auto message = log->next()) {
    ++messages;
    const Channel& channel = *message->channel;
    if (!layouts.contains(&channel)) {
      try {
        layouts[&channel] = layout_of(channel);
      } catch (const BadDefinition& error) {
        fmt::print(stderr, "{}: {}\n", channel.topic, error.what());
        layouts[&channel] = std::nullopt;
      }
    }
    std::string line = fmt::format("{} {}", channel.topic, message->log_time_ns);
    const std::size_t head = line.size();
    const auto& layout = layouts[&channel];
    const bool is_read = layout && visit(*layout, channel.encoding, message->bytes,
                                         [&](std::string_view path, const Value& value) {
                                           if (!is_quiet)
                                             line += fmt::format(" {}={}", path, text_of_value(value));
                                         });
    if (!is_read) {
      ++undecoded;
      line.resize(head);
      line += " bytes=" + hex({reinterpret_cast<const char*>(message->bytes.data()), message->bytes.size()});
    }
    if (!is_quiet) std::puts(line.c_str());
  }
  fmt::print(
      stderr, "{}: {}, {} messages, {} not decoded, {} channels{}\n", argv[1], log->format(), messages,
      undecoded, log->channels().size(),
      log->cut() ? ", cut at byte " + std::to_string(log->cut()->byte) + ": " + log->cut()->reason : "");
  return 0;
} catch (const std::exception& error) {
  fmt::print(stderr, "{}\n", error.what());
  return 3;
}
