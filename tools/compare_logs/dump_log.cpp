// Every message of a log as a line: topic, time [ns], number of fields, SHA-256 of the fields as text. An
// oracle prints the same. With --fields also each field. tools/compare_logs.sh compares.
#include <bit>
#include <cmath>
#include <cstdio>

#include <fmt/format.h>

#include "trundle/io/file.hpp"
#include "trundle/logs/definitions.hpp"
#include "trundle/logs/field_reader.hpp"

namespace {

/// Numbers by their bits as doubles; whole ones that doubles do not hold by their digits.
std::string canonical(const trundle::logs::Value& value) {
  constexpr double kWhole = 9007199254740992.0;
  const auto bits = [](double number) {
    return std::isnan(number) ? std::string("nan")
                              : fmt::format("{:016x}", std::bit_cast<std::uint64_t>(number));
  };
  if (const auto* const text = std::get_if<std::string_view>(&value)) {
    std::string hex = "t";
    for (const char c : *text) hex += fmt::format("{:02x}", static_cast<unsigned char>(c));
    return hex;
  }
  if (const auto* const whole = std::get_if<std::int64_t>(&value))
    return std::abs(static_cast<double>(*whole)) < kWhole ? bits(static_cast<double>(*whole))
                                                          : fmt::format("i{}", *whole);
  if (const auto* const whole = std::get_if<std::uint64_t>(&value))
    return static_cast<double>(*whole) < kWhole ? bits(static_cast<double>(*whole))
                                                : fmt::format("i{}", *whole);
  if (const auto* const number = std::get_if<double>(&value)) return bits(*number);
  return "none";
}

}  // namespace

int main(int count, char** arguments) {
  using namespace trundle;
  const bool shows_fields = count > 2 && std::string_view(arguments[2]) == "--fields";
  const std::unique_ptr<logs::Log> log = logs::open_log(arguments[1]);
  while (const std::optional<logs::Message> message = log->next()) {
    std::string fields;
    std::size_t number = 0;
    try {
      logs::visit(logs::layout_of(*message->channel), message->channel->encoding, message->bytes,
                  [&](std::string_view path, const logs::Value& value) {
                    fields += fmt::format("{}={}\n", path, canonical(value));
                    ++number;
                  });
    } catch (const logs::BadDefinition&) {
      fields = "not decoded";
    }
    fmt::print("{} {} {} {}\n", message->channel->topic, message->log_time_ns, number, io::sha256_of(fields));
    if (shows_fields) fmt::print("{}", fields);
  }
  if (log->cut()) fmt::print(stderr, "cut at byte {}: {}\n", log->cut()->byte, log->cut()->reason);
}
