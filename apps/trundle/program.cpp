#include "program.hpp"

#include <algorithm>
#include <array>
#include <csignal>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>

#include "trundle/io/words.hpp"

#include "command.hpp"
#include "commands.hpp"

namespace trundle::app {
namespace {

int fail(ExitCode code, const char* what) {
  print_error(fmt::format("trundle: {}\n", one_line(what)));
  return code;
}

/// A file that is opened later would take the number of a stream that is closed, and hold what is printed.
void open_closed_streams() {
  constexpr std::array kSubstitutes = {"/dev/null", "/dev/full", "/dev/null"};  // what stdout loses is told
  for (int stream = 0; stream <= 2; ++stream)
    if (fcntl(stream, F_GETFD) < 0)
      (void)open(kSubstitutes[static_cast<std::size_t>(stream)], stream == 0 ? O_RDONLY : O_WRONLY);
}

/// What is left for the way out when memory is spent: destructors, of JSON among others, allocate.
std::unique_ptr<char[]>& reserve() {
  constexpr std::size_t kBytes = 1 << 20;  // as much as a deep JSON takes to be taken apart
  static auto bytes = std::make_unique_for_overwrite<char[]>(kBytes);
  return bytes;
}

void keep_reserve() {
  reserve();
  std::set_new_handler([] {
    reserve().reset();
    throw std::bad_alloc();
  });
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
  open_closed_streams();
  std::signal(SIGXFSZ, SIG_IGN);  // a file that may not grow is an error, which is told
  try {
    keep_reserve();
    CLI::App app;
    add_commands(app);
    parse(app, argc, argv);
    require_printed();
    return kDone;
  } catch (const CLI::ParseError& error) {
    return fail(kUsage, error.what());
  } catch (const Exit& exit) {
    return exit.message.empty() ? exit.code : fail(exit.code, exit.message.c_str());
  } catch (const std::bad_alloc&) {
    return fail(kBadInput, "no memory is left; expected shorter recordings, or a higher limit");
  } catch (const std::exception& error) {
    return fail(exit_code_of(error), error.what());
  }
}

}  // namespace trundle::app
