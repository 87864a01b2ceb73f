#include "command.hpp"

#include <charconv>
#include <cstdio>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/io/words.hpp"
#include "trundle/recording/csv/number.hpp"
#include "trundle/report/json_text.hpp"

namespace trundle::app {

CLI::App* add_command(CLI::App& app, const std::string& name, const std::string& description,
                      const std::string& example, Common& common) {
  CLI::App* command = app.add_subcommand(name, description);
  command->footer("\nExample:\n  " + example);
  command->add_flag("--json", common.json, "Print one JSON document on stdout");
  command->add_flag("--quiet", common.quiet, "Print nothing but errors");
  return command;
}

CLI::Validator number_from(double low, double high) {
  const std::string range = fmt::format("a number from {:g} to {:g}", low, high);
  const auto complaint = [=](const std::string& text) -> std::string {
    const char* const end = text.data() + text.size();
    double value = 0.0;
    // Of NaN no comparison holds.
    if (read_any_number(text.data(), end, value) == end && value >= low && value <= high) return {};
    return fmt::format("'{}' is not {}", text, range);
  };
  return {complaint, fmt::format("{:g} to {:g}", low, high)};
}

CLI::Validator whole_number() {
  const auto complaint = [](const std::string& text) -> std::string {
    const char* const end = text.data() + text.size();
    std::uint64_t value = 0;
    const auto [last, error] = std::from_chars(text.data(), end, value);
    if (error == std::errc{} && last == end) return {};
    return fmt::format("'{}' is not a whole number from 0 to {}", text,
                       std::numeric_limits<std::uint64_t>::max());
  };
  return {complaint, ""};
}

void add_read_options(CLI::App& command, ReadOptions& reading) {
  command.add_option("--robot-number", reading.robot_number, kRobotNumberHelp)->check(CLI::Range(1, 1000));
  add_log_options(command, reading);
}

void add_log_options(CLI::App& command, ReadOptions& reading) {
  command.add_option(
      "--recording", reading.map,
      "Of a log (.bag, .mcap, .db3, ...) given as RECORDING: the recording.toml that maps its topics; "
      "default: the one beside it");
  command.add_option("--msg-path", reading.msg_path,
                     "Folder with .msg files, for logs that hold no definitions of their own types");
}

void refuse_empty_values(CLI::App& app) {
  const CLI::Validator not_empty(
      [](const std::string& text) { return std::string(text.empty() ? "is given nothing" : ""); }, "");
  for (CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
    for (CLI::Option* option : command->get_options([](const CLI::Option*) { return true; }))
      if (option->get_items_expected_max() > 0) option->check(not_empty);
}

void print(const Common& common, const nlohmann::ordered_json& document, const std::string& text) {
  if (common.json) {
    fmt::print("{}\n", dumped(document, 2));
  } else if (!common.quiet) {
    fmt::print("{}", printable(text));
  }
}

void print_error(const std::string& text) {
  std::fputs(text.c_str(), stderr);
}

void require_printed() {
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
    throw InputError("standard output", "cannot be written to its end", "a place with room for it");
}

}  // namespace trundle::app
