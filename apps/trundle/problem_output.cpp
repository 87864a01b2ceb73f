#include "problem_output.hpp"

#include <fmt/format.h>

namespace trundle::app {
namespace {

const char* word_of(Severity severity) {
  return severity == Severity::warning ? "warning" : "note";
}

}  // namespace

nlohmann::ordered_json to_json(const Problem& problem) {
  return {{"severity", word_of(problem.severity)},
          {"kind", problem.kind},
          {"place", problem.place},
          {"count", problem.count},
          {"message", problem.message}};
}

std::string line_of(const Problem& problem) {
  return fmt::format("{}: {}: {}\n", word_of(problem.severity), problem.place, problem.message);
}

}  // namespace trundle::app
