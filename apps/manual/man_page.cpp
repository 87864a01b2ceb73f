#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "trundle/io/error.hpp"

#include "pages.hpp"

namespace trundle::app {
using namespace io;
namespace {

constexpr std::array kExitStatus = {
    std::pair{kDone, "done"},
    std::pair{kBug, "a fault of the program: please report it"},
    std::pair{kUsage, "the command line is wrong"},
    std::pair{kBadInput, "an input is wrong, an output cannot be written, or memory does not suffice"},
    std::pair{kCannotAnswer, "the inputs are well-formed but cannot answer the question"},
};

/// Characters that roff prints otherwise than they are, and what prints them.
const std::map<char, std::string> kRoff = {
    {'-', "\\-"}, {'\\', "\\e"}, {'^', "\\(ha"}, {'~', "\\(ti"}, {'`', "\\(ga"}, {'\'', "\\(aq"},
};

std::string roff(const std::string& text) {
  std::string escaped = "\\&";  // prints nothing; a '.' behind it is no command
  for (const char character : text) {
    const auto found = kRoff.find(character);
    escaped += found == kRoff.end() ? std::string(1, character) : found->second;
  }
  return escaped;
}

std::string entry(const std::string& heading, const std::string& text) {
  return fmt::format(".TP\n{}\n{}\n", heading, roff(text));
}

std::string entry(const Argument& argument) {
  std::vector<std::string> names;
  for (const std::string& name : argument.names) names.push_back(fmt::format("\\fB{}\\fR", roff(name)));
  const std::string gap = names.empty() || argument.placeholder.empty() ? "" : " ";
  return entry(fmt::format("{}{}\\fI{}\\fR{}", fmt::join(names, ", "), gap, roff(argument.placeholder),
                           argument.repeated ? "..." : ""),
               argument.description + "." + argument.details);
}

/// What every command has is told once.
std::vector<Argument> shared_arguments(const Manual& manual) {
  std::vector<Argument> shared = manual.commands.front().arguments;
  for (const Command& command : manual.commands)
    std::erase_if(shared, [&](const Argument& argument) {
      return std::ranges::find(command.arguments, argument) == command.arguments.end();
    });
  return shared;
}

std::string section(const Manual& manual, const Command& command, const std::vector<Argument>& shared) {
  std::string text =
      fmt::format(".SS {}\n{}.\n.PP\n\\fB{} {}\\fR [\\fIOPTIONS\\fR] \\fI{}\\fR\n", command.name,
                  roff(command.description), manual.name, roff(command.name), roff(command.usage));
  for (const Argument& argument : command.arguments)
    if (std::ranges::find(shared, argument) == shared.end()) text += entry(argument);
  text += ".PP\nExample:\n.PP\n.EX\n";
  for (const std::string& line : CLI::detail::split(command.example, '\n')) text += roff(line) + "\n";
  return text + ".EE\n";
}

}  // namespace

std::string man_page(const Manual& manual) {
  const std::vector<Argument> shared = shared_arguments(manual);
  std::string page = fmt::format(R"(.TH TRUNDLE 1 "" "{0} {1}" "User Commands"
.SH NAME
{0} \- {2}
.SH SYNOPSIS
.B {0}
\fICOMMAND\fR [\fIOPTIONS\fR] [\fIARGUMENTS\fR]
.PP
.B {0} \-\-help
.PP
.B {0} \-\-version
.SH DESCRIPTION
A recording is a folder of CSV files of what a robot's sensors saw; a robot file (TOML) says what the robot is.
The commands calibrate the robot, find where its wheels slipped, and estimate its trajectory and a map, all with
their uncertainty. The same inputs and options give the same bytes.
An error is one line on standard error: place, fact, and what was expected.
)",
                                 manual.name, manual.version, roff(manual.description));
  page += ".SH OPTIONS\nOf every command:\n";
  for (const Argument& argument : shared) page += entry(argument);
  page += ".SH COMMANDS\n";
  for (const Command& command : manual.commands) page += section(manual, command, shared);
  page += ".SH EXIT STATUS\n";
  for (const auto& [code, meaning] : kExitStatus) page += entry(fmt::format(".B {}", int{code}), meaning);
  page += R"(.SH SEE ALSO
The pages in share/doc/trundle beneath where trundle is installed, README.md first: the formats of recordings,
robot files and outputs, and what each number means.
)";
  return page;
}

}  // namespace trundle::app
