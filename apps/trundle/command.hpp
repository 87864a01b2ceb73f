#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "trundle/io/error.hpp"
#include "trundle/pipeline/provenance.hpp"
#include "trundle/recording/recording.hpp"

#include "names.hpp"

namespace trundle::app {

/// Thrown by a command that has done what can be done, and still failed.
struct Exit {
  ExitCode code = kBug;
  std::string message = {};  ///< for stderr; empty: all is told already
};

/// Flags every command has.
struct Common {
  bool json = false;   ///< one JSON document on stdout instead of text
  bool quiet = false;  ///< no text on stdout, no progress
};

/// Adds a subcommand with the common flags; `example` is shown at the end of its --help.
CLI::App* add_command(CLI::App& app, const std::string& name, const std::string& description,
                      const std::string& example, Common& common);

/// A number on the command line: finite, and from `low` to `high`.
CLI::Validator number_from(double low, double high);
/// Below any that means something, and above 0; above any that means something.
inline constexpr double kSmallest = 1e-12;
inline constexpr double kLargest = 1e9;

/// A seed: a whole number of 64 bits.
CLI::Validator whole_number();
/// How recordings are read: the number of a robot of a folder that holds several, what maps a log.
void add_read_options(CLI::App& command, ReadOptions& reading);
/// The same without the number of a robot.
void add_log_options(CLI::App& command, ReadOptions& reading);
inline constexpr const char* kRobotNumberHelp = "Which robot of a folder that holds several";

/// No value of an option is empty: a script whose variable is would get something else than it asked for.
void refuse_empty_values(CLI::App& app);

/// Prints the document when --json was given, else the text unless --quiet.
void print(const Common& common, const nlohmann::ordered_json& document, const std::string& text);

/// On stderr; where nobody can hear it, nothing else changes.
void print_error(const std::string& text);

/// What was printed has arrived, else throws InputError: a full disk behind stdout is no success.
void require_printed();

// One function for each command, each in a file of its own: declares options, sets the callback.
void add_calibrate(CLI::App& app);
void add_umbmark(CLI::App& app);
void add_odometry(CLI::App& app);
void add_slip(CLI::App& app);
void add_slam(CLI::App& app);
void add_merge(CLI::App& app);
void add_localize(CLI::App& app);
void add_evaluate(CLI::App& app);
void add_simulate(CLI::App& app);
void add_info(CLI::App& app);
void add_init(CLI::App& app);
void add_install_angle(CLI::App& app);
void add_report(CLI::App& app);
void add_run(CLI::App& app);

}  // namespace trundle::app
