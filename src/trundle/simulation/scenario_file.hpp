#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "trundle/simulation/scenario.hpp"
#include "trundle/simulation/sheet.hpp"

namespace trundle::simulation {

/// One run of a scenario file and where its recording goes.
struct PlannedRun {
  std::string name;
  std::string session;
  Scenario scenario;
};

/// The [sheet] of a scenario file.
struct PlannedSheet {
  Scenario scenario;
  SheetPlan plan;
};

/// A scenario file: runs of one robot in one or several sessions. docs/simulation.md describes the format.
struct Plan {
  std::string name;
  std::uint64_t seed = 1;
  std::vector<PlannedRun> runs;
  std::optional<PlannedSheet> sheet;  ///< a hand-measured UMBmark sheet to write as well
  std::vector<InputFile> inputs;      ///< the scenario file and the robot file
};

/// Reads a scenario file; paths in it are relative to it. A given seed replaces the file's.
/// Throws InputError with file, line, fact and expectation; unknown keys are errors that name the nearest
/// known one.
Plan read_plan(const std::filesystem::path& path, std::optional<std::uint64_t> seed = std::nullopt);

/// Simulates all runs and writes them: the recording into `folder` when there is one run alone, else each
/// into folder/session/run. Beside them robot.toml (nominal) and truth.toml. `provenance` becomes comment
/// lines.
void write_plan(const Plan& plan, const std::filesystem::path& folder,
                const std::vector<std::string>& provenance);

/// The folder of a run below that of its plan.
[[nodiscard]] std::filesystem::path folder_of(const Plan& plan, const PlannedRun& run,
                                              const std::filesystem::path& folder);

}  // namespace trundle::simulation
