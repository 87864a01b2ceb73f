#include "shared_output.hpp"

#include <fmt/format.h>

#include "trundle/io/words.hpp"
#include "trundle/recording/trajectory_file.hpp"

namespace trundle::app {

std::string line_of(const Finding& problem) {
  return one_line(fmt::format("{}: {}: {}", word_of(problem.severity), problem.place, describe(problem))) +
         "\n";
}

OutputFile trajectory_file(const std::filesystem::path& path, const Provenance& provenance,
                           const Trajectory& trajectory) {
  return {path, head_of(provenance) + (path.extension() == ".tum" ? to_tum(trajectory) : to_csv(trajectory))};
}

}  // namespace trundle::app
