#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace trundle::app {

/// An option, a flag or a positional argument.
struct Argument {
  std::vector<std::string> names;    ///< with their dashes, short before long; none: positional
  std::string placeholder;           ///< of its value, as --help has it; empty: a flag
  std::vector<std::string> choices;  ///< the values that are possible; none: not a fixed list
  std::string description;
  std::string details;    ///< sentences: its range, its default, what it needs
  bool repeated = false;  ///< takes any number of values

  bool operator==(const Argument&) const = default;
};

struct Command {
  std::string name;
  std::string description;
  std::string usage;    ///< positional arguments as in a synopsis: "RECORDING [MAP]"
  std::string example;  ///< lines of a shell
  std::vector<Argument> arguments;
};

/// What the program knows of itself: all that its man page and its completions are made of.
struct Manual {
  std::string name;
  std::string version;
  std::string description;
  std::vector<Argument> arguments;  ///< without a command
  std::vector<Command> commands;
};

Manual manual_of(const CLI::App& app);

}  // namespace trundle::app
