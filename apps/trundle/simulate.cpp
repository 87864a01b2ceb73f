#include <filesystem>

#include <fmt/format.h>

#include "trundle/pipeline/simulation_answer.hpp"

#include "command.hpp"

namespace trundle::app {
namespace {

struct SimulateArguments {
  Common common;
  std::string scenario;
  std::string output;
  std::optional<std::uint64_t> seed;
};

std::string text_of(const Plan& plan, const SimulateArguments& options) {
  std::string text;
  for (const PlannedRun& run : plan.runs)
    text += fmt::format("{}: {:.1f} m in {:.0f} s\n", folder_of(plan, run, options.output).string(),
                        length_of(run.scenario.path), duration_of(run.scenario.path));
  if (plan.sheet)
    text +=
        fmt::format("{}: {} + {} squares\n", (std::filesystem::path(options.output) / "sheet.csv").string(),
                    plan.sheet->plan.runs, plan.sheet->plan.runs);
  return text;
}

void run(const SimulateArguments& options) {
  const Plan plan = read_plan(options.scenario, options.seed);
  write_simulation(plan, options.output);
  print(options.common, document_of(plan, options.output), text_of(plan, options));
}

}  // namespace

void add_simulate(CLI::App& app) {
  auto options = std::make_shared<SimulateArguments>();
  CLI::App* command =
      add_command(app, "simulate", "Make recordings of a robot whose truth is known",
                  "trundle simulate data/demo/scenario.toml -o out/simulated", options->common);
  command->add_option("scenario", options->scenario, "Scenario file (docs/simulation.md)")->required();
  command
      ->add_option("-o,--output", options->output,
                   "Folder to write: the recording, or one folder for each run")
      ->required();
  command->add_option("--seed", options->seed, "Seed of all random numbers, instead of the scenario's")
      ->check(whole_number());
  command->callback([options] { run(*options); });
}

}  // namespace trundle::app
