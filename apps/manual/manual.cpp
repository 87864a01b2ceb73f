#include "manual.hpp"

#include <algorithm>
#include <set>

#include <fmt/format.h>

namespace trundle::app {
namespace {

/// The names of options that another one needs or excludes. CLI11 keeps them in the order of their addresses.
std::string names_of(const std::set<CLI::Option*>& options) {
  std::set<std::string> names;
  for (const CLI::Option* option : options) names.insert(option->get_name());
  return fmt::format("{}", fmt::join(names, ", "));
}

/// CLI::Range shows "INT in [1 - 9]", number_from "1 to 9".
std::string range_of(const std::string& limits) {
  const std::size_t bracket = limits.find('[');
  if (bracket == std::string::npos) return limits;
  return CLI::detail::find_and_replace(limits.substr(bracket + 1, limits.size() - bracket - 2), " - ",
                                       " to ");
}

/// CLI11 shows a value as TYPE, TYPE:{one,another} or TYPE:range.
Argument argument_of(const CLI::Option& option) {
  const std::string shown = option.get_type_name();
  const std::size_t colon = std::min(shown.find(':'), shown.size());
  const std::string limits = shown.substr(std::min(colon + 1, shown.size()));

  Argument argument;
  for (const std::string& name : option.get_snames()) argument.names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) argument.names.push_back("--" + name);
  if (option.get_items_expected_max() > 0)
    argument.placeholder = option.get_positional() ? option.get_name(true) : shown.substr(0, colon);
  argument.repeated = option.get_expected_max() >= CLI::detail::expected_max_vector_size;
  argument.description = option.get_description();
  const auto add = [&](const std::string& what, const std::string& text) {
    if (!text.empty()) argument.details += fmt::format(" {}{}.", what, text);
  };
  if (limits.starts_with('{')) {
    argument.choices = CLI::detail::split(limits.substr(1, limits.size() - 2), ',');
    add("One of ", fmt::format("{}", fmt::join(argument.choices, ", ")));
  } else {
    add("From ", range_of(limits));
  }
  add("Default: ", option.get_default_str());
  add("Only with ", names_of(option.get_needs()));
  add("Not with ", names_of(option.get_excludes()));
  if (option.get_required() && !option.get_positional()) add("", "Required");
  return argument;
}

std::vector<Argument> arguments_of(const CLI::App& command) {
  std::vector<Argument> arguments;
  for (const CLI::Option* option : command.get_options()) arguments.push_back(argument_of(*option));
  return arguments;
}

std::string usage_of(const CLI::App& command) {
  std::vector<std::string> positionals;
  for (const CLI::Option* option : command.get_options())
    if (option->get_positional()) positionals.push_back(CLI::Formatter().make_option_usage(option));
  return fmt::format("{}", fmt::join(positionals, " "));
}

/// add_command puts it behind a title.
std::string example_of(const CLI::App& command) {
  const std::string footer = command.get_footer();
  const std::string title = "Example:\n";
  const std::size_t place = footer.find(title);
  return place == std::string::npos ? "" : footer.substr(place + title.size());
}

}  // namespace

Manual manual_of(const CLI::App& app) {
  Manual manual{app.get_name(), app.version(), app.get_description(), arguments_of(app), {}};
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
    manual.commands.push_back({command->get_name(), command->get_description(), usage_of(*command),
                               example_of(*command), arguments_of(*command)});
  return manual;
}

}  // namespace trundle::app
