#include "shared_output.hpp"

#include <fmt/format.h>

#include "trundle/recording/increments.hpp"

namespace trundle::app {

const char* word_of(Severity severity) {
  return severity == Severity::warning ? "warning" : "note";
}

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

std::string head_of(const Provenance& provenance) {
  std::string text;
  for (const std::string& line : to_lines(provenance)) text += "# " + line + "\n";
  return text;
}

void write_trajectory(const std::filesystem::path& path, const Provenance& provenance,
                      const Trajectory& trajectory) {
  write_file(path,
             head_of(provenance) + (path.extension() == ".tum" ? to_tum(trajectory) : to_csv(trajectory)));
}

}  // namespace trundle::app
