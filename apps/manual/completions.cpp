#include <fmt/format.h>

#include "pages.hpp"

namespace trundle::app {
namespace {

/// Puts a backslash before each of `special`.
std::string escaped(const std::string& text, const std::string& special) {
  std::string result;
  for (const char character : text) {
    if (special.find(character) != std::string::npos) result += '\\';
    result += character;
  }
  return result;
}

/// Between single quotes of bash and zsh, where nothing but the quote itself is special.
std::string quoted(const std::string& text) {
  return "'" + CLI::detail::find_and_replace(text, "'", "'\\''") + "'";
}

void add_word(std::string& words, const std::string& word) {
  words += (words.empty() ? "" : " ") + word;
}

std::string words_of(const std::vector<Argument>& arguments) {
  std::string words;
  for (const Argument& argument : arguments)
    for (const std::string& name : argument.names) add_word(words, name);
  return words;
}

std::string words_of(const std::vector<Command>& commands) {
  std::string words;
  for (const Command& command : commands) add_word(words, command.name);
  return words;
}

}  // namespace

std::string bash_completion(const Manual& manual) {
  std::string values, options;
  for (const Command& command : manual.commands) {
    options += fmt::format("          {}) words='{}' ;;\n", command.name, words_of(command.arguments));
    for (const Argument& argument : command.arguments)
      if (!argument.choices.empty())
        for (const std::string& name : argument.names)
          values += fmt::format("    '{} {}') words='{}' ;;\n", command.name, name,
                                fmt::join(argument.choices, " "));
  }
  return fmt::format(R"(# Completion of {0} in bash, made from what the program knows of itself.
_{0}() {{
  local current=${{COMP_WORDS[COMP_CWORD]}} previous=${{COMP_WORDS[COMP_CWORD - 1]}} words=''
  # Of --option=value bash makes three words.
  if [[ $current == = ]]; then
    current=''
  elif [[ $previous == = ]]; then
    previous=${{COMP_WORDS[COMP_CWORD - 2]}}
  fi
  case "${{COMP_WORDS[1]}} $previous" in
{1}    *)
      if ((COMP_CWORD == 1)); then
        words='{2} {3}'
      elif [[ $current == -* ]]; then
        case ${{COMP_WORDS[1]}} in
{4}        esac
      fi
      ;;
  esac
  COMPREPLY=($(compgen -W "$words" -- "$current"))
}}
complete -o default -F _{0} {0}
)",
                     manual.name, values, words_of(manual.commands), words_of(manual.arguments), options);
}

namespace {

/// One specification of zsh's _arguments: '(-o --output)'{-o+,--output=}'[what it does]:TEXT:_files'.
std::string zsh_specification(const Argument& argument) {
  const bool flag = argument.placeholder.empty();
  const std::string values =
      argument.choices.empty() ? "_files" : fmt::format("({})", fmt::join(argument.choices, " "));
  if (argument.names.empty())
    return quoted(fmt::format("{}:{}:{}", argument.repeated ? "*" : "", argument.placeholder, values));
  std::vector<std::string> names;
  for (const std::string& name : argument.names)
    names.push_back(name + (flag ? "" : name.starts_with("--") ? "=" : "+"));
  const std::string once = argument.repeated ? "*" : fmt::format("({})", fmt::join(argument.names, " "));
  const std::string rest = fmt::format("[{}]{}", escaped(argument.description, "\\[]:"),
                                       flag ? "" : fmt::format(":{}:{}", argument.placeholder, values));
  if (names.size() == 1) return quoted(once + names.front() + rest);
  return fmt::format("{}{{{}}}{}", quoted(once), fmt::join(names, ","), quoted(rest));
}

std::string zsh_specifications(const std::vector<Argument>& arguments, const std::string& indent) {
  std::string lines;
  for (const Argument& argument : arguments)
    lines += fmt::format(" \\\n{}{}", indent, zsh_specification(argument));
  return lines;
}

}  // namespace

std::string zsh_completion(const Manual& manual) {
  std::string commands, arguments;
  for (const Command& command : manual.commands) {
    commands += fmt::format("    {}\n", quoted(command.name + ":" + escaped(command.description, "\\:")));
    arguments += fmt::format("        {}) _arguments{} ;;\n", command.name,
                             zsh_specifications(command.arguments, "          "));
  }
  return fmt::format(R"(#compdef {0}
# Completion of {0} in zsh, made from what the program knows of itself.
_{0}() {{
  local curcontext=$curcontext state line
  local -a commands=(
{1}  )
  _arguments -C{2} \
    '1:command:->command' \
    '*::argument:->argument'
  case $state in
    command) _describe command commands ;;
    argument)
      case $line[1] in
{3}      esac
      ;;
  esac
}}
_{0} "$@"
)",
                     manual.name, commands, zsh_specifications(manual.arguments, "    "), arguments);
}

namespace {

std::string fish_quoted(const std::string& text) {
  return "'" + escaped(text, "\\'") + "'";
}

std::string fish_line(const std::string& program, const std::string& condition, const Argument& argument) {
  std::string line = fmt::format("complete -c {} -n '{}'", program, condition);
  for (const std::string& name : argument.names)
    line += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
  if (!argument.choices.empty())
    line += fmt::format(" -x -a '{}'", fmt::join(argument.choices, " "));
  else if (!argument.placeholder.empty())
    line += " -r -F";
  return line + " -d " + fish_quoted(argument.description) + "\n";
}

}  // namespace

std::string fish_completion(const Manual& manual) {
  std::string text =
      fmt::format("# Completion of {} in fish, made from what the program knows of itself.\n", manual.name);
  const std::string none = "__fish_use_subcommand";
  for (const Argument& argument : manual.arguments) text += fish_line(manual.name, none, argument);
  for (const Command& command : manual.commands)
    text += fmt::format("complete -c {} -n {} -f -a {} -d {}\n", manual.name, none, command.name,
                        fish_quoted(command.description));
  for (const Command& command : manual.commands)
    for (const Argument& argument : command.arguments)
      if (!argument.names.empty())
        text += fish_line(manual.name, "__fish_seen_subcommand_from " + command.name, argument);
  return text;
}

}  // namespace trundle::app
