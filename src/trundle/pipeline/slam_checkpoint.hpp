#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "trundle/slam/slam.hpp"

namespace trundle::pipeline {

/// Where a run of `trundle slam` is stored, and from where it is taken up. Neither leaves a trace in the
/// results.
struct SlamCheckpoints {
  std::filesystem::path write = {};    ///< empty: none is written
  std::optional<double> every_s = {};  ///< of the recording's time; nothing: only near the end
  std::filesystem::path resume = {};   ///< empty: from the start
};

/// Told after each step: how many are done, and of how many.
using OnSteps = std::function<void(std::size_t done, std::size_t of)>;

/// slam(), stored and taken up as asked. `settings` says in words all that a run depends on besides the
/// recording: a checkpoint goes on under the same alone. Throws InputError where the checkpoint is none, or
/// of another recording or other settings.
SlamResult slam_with_checkpoints(const SlamInput& input, SlamRun run, const std::string& settings,
                                 const SlamCheckpoints& checkpoints, const OnSteps& on_steps = {});

}  // namespace trundle::pipeline
