#include "program.hpp"

#include <algorithm>
#include <csignal>
#include <string>
#include <vector>

#include <fmt/core.h>

#include "trundle/io/words.hpp"

#include "command.hpp"
#include "commands.hpp"

namespace trundle::app {
namespace {

int fail(ExitCode code, const char* what) {
  fmt::print(stderr, "trundle: {}\n", one_line(what));
  return code;
}

/// A misspelt command is named as what is wrong, with the one that may be meant.
void require_command(const CLI::App& app, int argc, char** argv) {
  const std::string first = argc > 1 ? argv[1] : "";
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(command->get_name());
  if (first.empty() || first.front() == '-' || std::ranges::find(names, first) != names.end()) return;
  const std::string nearest = nearest_name(first, names);
  throw CLI::ValidationError(nearest.empty()
                                 ? fmt::format("unknown command '{}'; --help names all", first)
                                 : fmt::format("unknown command '{}'; expected '{}'", first, nearest));
}

/// Runs the command that is named, or prints help or the version.
void parse(CLI::App& app, int argc, char** argv) {
  require_command(app, argc, argv);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& success) {
    app.exit(success);
    return;
  }
  if (app.get_subcommands().empty()) throw CLI::RequiredError("A command");
}

}  // namespace

int run_program(int argc, char** argv) {
  std::signal(SIGXFSZ, SIG_IGN);  // a file that may not grow is an error, which is told
  CLI::App app;
  add_commands(app);
  try {
    parse(app, argc, argv);
    require_printed();
    return kDone;
  } catch (const CLI::ParseError& error) {
    return fail(kUsage, error.what());
  } catch (const Exit& exit) {
    return exit.message.empty() ? exit.code : fail(exit.code, exit.message.c_str());
  } catch (const std::exception& error) {
    return fail(exit_code_of(error), error.what());
  }
}

}  // namespace trundle::app
