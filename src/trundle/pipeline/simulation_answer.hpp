#pragma once

#include <filesystem>

#include <nlohmann/json_fwd.hpp>

#include "trundle/report/provenance.hpp"
#include "trundle/simulation/scenario_file.hpp"

namespace trundle::pipeline {

/// What `trundle simulate` writes: the recordings of a plan below a folder. Throws as write_plan.
void write_simulation(const Plan& plan, const std::filesystem::path& folder);

/// What `trundle simulate --json` prints.
nlohmann::ordered_json document_of(const Plan& plan, const std::filesystem::path& folder);

}  // namespace trundle::pipeline
