#include "trundle/pipeline/simulation_answer.hpp"

#include <nlohmann/json.hpp>

namespace trundle::pipeline {
namespace {

Provenance provenance_of(const Plan& plan) {
  return {.inputs = plan.inputs, .options = {}, .seed = plan.seed};
}

}  // namespace

void write_simulation(const Plan& plan, const std::filesystem::path& folder) {
  write_plan(plan, folder, to_lines(provenance_of(plan)));
}

nlohmann::ordered_json document_of(const Plan& plan, const std::filesystem::path& folder) {
  nlohmann::ordered_json document = to_json(provenance_of(plan));
  document["recordings"] = nlohmann::ordered_json::array();
  for (const PlannedRun& run : plan.runs)
    document["recordings"].push_back({{"folder", folder_of(plan, run, folder).string()},
                                      {"session", run.session},
                                      {"length_m", length_of(run.scenario.path)},
                                      {"duration_s", duration_of(run.scenario.path)}});
  if (plan.sheet) document["sheet"] = (folder / "sheet.csv").string();
  return document;
}

}  // namespace trundle::pipeline
