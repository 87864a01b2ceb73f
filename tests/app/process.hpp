#pragma once

#include <chrono>
#include <csignal>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace trundle::test {

using Arguments = std::vector<std::string>;

/// What a finished run of the program left behind.
struct Outcome {
  int exit_code = -1;          ///< -1: killed by a signal
  std::string out;             ///< all of stdout
  std::string err;             ///< all of stderr
  std::size_t peak_bytes = 0;  ///< of memory
};

/// What a run of the program meets.
struct Circumstances {
  std::string input = {};                             ///< file in the folder that is its stdin
  std::optional<std::size_t> ended_after_input = {};  ///< a signal comes once it was given these bytes
  std::optional<std::chrono::microseconds> ended_after = {};  ///< a signal comes where it takes longer
  int signal = SIGKILL;
  std::vector<int> closed = {};                  ///< streams that are not open: 0, 1, 2
  std::optional<std::size_t> memory_bytes = {};  ///< of addresses that it may have
  std::string program = TRUNDLE_PROGRAM;
};

/// Runs the program in a folder and waits for it.
Outcome run_program(const std::filesystem::path& folder, const Arguments& arguments,
                    const Circumstances& circumstances);
/// Kills it where it takes longer than `killed_after`.
Outcome run_program(const std::filesystem::path& folder, const Arguments& arguments,
                    std::optional<std::chrono::microseconds> killed_after = {});

}  // namespace trundle::test
