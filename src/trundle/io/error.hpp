#pragma once

#include <exception>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

#include "trundle/namespaces.hpp"

namespace trundle::io {

/// Wrong input or configuration: one line that names the place, the fact and what was expected.
class InputError : public std::runtime_error {
 public:
  /// `place` is "file" or "file:line"; `fact` what stands there; `expectation` what should. The message is
  /// one line, whatever they quote.
  InputError(std::string_view place, std::string_view fact, std::string_view expectation);
};

/// "file:line", the form every message uses.
[[nodiscard]] std::string place(std::string_view file, std::size_t line);

/// The data are well-formed but cannot answer the question that was asked.
class CannotAnswer : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What a program exits with: docs/commands.md.
enum ExitCode : int {
  kDone = 0,
  kBug = 1,    ///< after an error that nobody expected
  kUsage = 2,  ///< a wrong command line
  kBadInput = 3,
  kCannotAnswer = 4,
};
/// After an error: kBadInput after an InputError or where the system refuses (a loop of links, a folder that
/// may not be searched, a full disk), kCannotAnswer after a CannotAnswer, else kBug.
[[nodiscard]] ExitCode exit_code_of(const std::exception& error);

/// The candidate with the smallest edit distance to `name`; empty if none is near enough to be meant.
[[nodiscard]] std::string nearest_name(std::string_view name, std::span<const std::string> candidates);

}  // namespace trundle::io
