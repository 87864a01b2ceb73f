#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace trundle::test {

using Arguments = std::vector<std::string>;

/// What a finished run of the program left behind.
struct Outcome {
  int exit_code = -1;  ///< -1: killed by a signal
  std::string out;     ///< all of stdout
  std::string err;     ///< all of stderr
};

/// Runs the program in a folder and waits for it; kills it where it takes longer than `killed_after`.
Outcome run_program(const std::filesystem::path& folder, const Arguments& arguments,
                    std::optional<std::chrono::microseconds> killed_after = {});

}  // namespace trundle::test
