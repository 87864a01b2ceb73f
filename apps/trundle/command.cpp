#include "command.hpp"

#include <fmt/core.h>

namespace trundle::app {

CLI::App* add_command(CLI::App& app, const std::string& name, const std::string& description,
                      const std::string& example, Common& common) {
  CLI::App* command = app.add_subcommand(name, description);
  command->footer("\nExample:\n  " + example);
  command->add_flag("--json", common.json, "Print one JSON document on stdout");
  command->add_flag("--quiet", common.quiet, "Print nothing but errors");
  return command;
}

void print(const Common& common, const nlohmann::ordered_json& document, const std::string& text) {
  if (common.json) {
    fmt::print("{}\n", document.dump(2));
  } else if (!common.quiet) {
    fmt::print("{}", text);
  }
}

}  // namespace trundle::app
