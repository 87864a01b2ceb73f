#include "trundle/simulation/scenario_file.hpp"

#include <algorithm>

#include "trundle/chassis/detail/parse_toml.hpp"
#include "trundle/io/file.hpp"
#include "trundle/simulation/detail/path_table.hpp"
#include "trundle/simulation/detail/sensor_options.hpp"
#include "trundle/simulation/detail/true_robot.hpp"

namespace trundle::simulation {
namespace scenario_file {

namespace {

// Streams of a plan's seed: runs take those from kFirstRun on, sessions from kFirstSession on.
constexpr std::uint64_t kFirstSession = 1000;
constexpr std::uint64_t kFirstRun = 1000000;  // beyond the last of at most 9999 sessions
constexpr std::size_t kMostRuns = 9999;     // as many as one [[run]] may be repeated: all are held in memory
constexpr std::uint64_t kPathStream = 200;  // of a run's seed: beyond those of RandomStream

SlipBurst read_slip(const Section& section, const Scenario& scenario) {
  check_keys(section, names_with({"wheel"}, kSpan, kSlip));
  SlipBurst slip;
  slip.wheel = static_cast<int>(read_word(section, "wheel", scenario.nominal.wheel_names));
  read_numbers(section, kSpan, slip.span);
  read_numbers(section, kSlip, slip);
  if (slip.factor == 0.0 && scenario.steering == Steering::odometry)
    fail(section.source, section.table.get("factor")->source(),
         in(section, "a locked wheel (factor 0) on a robot that steers by its wheels"),
         "a factor above 0, or steering = \"truth\"");
  return slip;
}

void read_slips(const Section& run, Scenario& scenario) {
  for (const Section& section : tables(run, "slip", "[[run.slip]]"))
    scenario.slips.push_back(read_slip(section, scenario));
  RandomSlips& slips = scenario.random_slips;
  read_options(run, "random_slips", {"count"}, kRandomSlips, slips,
               [&](const Section& s) { read_whole(s, "count", 0, 10000, slips.count); });
  if (slips.count > 0 && scenario.truth.chassis.wheel_count == 0)
    fail(run.source, run.table.source(), in(run, "slip of a robot without wheels"), "none");
}

/// Everything of the file that runs have in common.
struct Common {
  Scenario scenario;
  Pace pace;
};

Steering read_steering(const Section& file) {
  static const std::vector<std::string> words = {"odometry", "truth"};
  if (!file.table.contains("steering")) return Steering::odometry;
  return read_word(file, "steering", words) == 0 ? Steering::odometry : Steering::truth;
}

Common read_common(const Section& file, const Robot& nominal, std::uint64_t seed) {
  Common common;
  Scenario& scenario = common.scenario;
  scenario.nominal = nominal;
  scenario.truth = read_truth(file, nominal);
  scenario.steering = read_steering(file);
  read_flag(file, "whole_intervals", scenario.whole_intervals);
  read_sensors(file, scenario, common.pace);
  scenario.landmarks = read_landmarks(file, seed);
  scenario.seed = seed;
  return common;
}

/// Of a plan or a run: it becomes the name of a folder.
std::string name_in(const Section& section, const std::string& otherwise) {
  if (!section.table.contains("name")) return otherwise;
  const std::string name = text(section, "name", "a string");
  const bool is_folder_name = !name.empty() &&
                              name.find_first_of(std::string_view("/\\\0", 3)) == std::string::npos &&
                              name[0] != '.';
  if (!is_folder_name)
    fail(section.source, section.table.get("name")->source(),
         in(section, fmt::format("name is \"{}\"", name)), "the name of a folder");
  return name;
}

/// What is simulated is held in memory.
void require_finite_run(const Section& run, const Scenario& scenario) {
  constexpr double kMostSamples = 1e7;  // of a stream: a day at 100 Hz
  const double rate_hz = std::max({scenario.encoders.rate_hz, scenario.gyro.rate_hz,
                                   scenario.reference.rate_hz, scenario.sightings.rate_hz});
  // Every segment, and the ramp at the end, may take up to a row of the encoders more.
  const double duration_s =
      duration_of(scenario.path) + static_cast<double>(scenario.path.size() + 2) / scenario.encoders.rate_hz;
  if (!(duration_s * rate_hz <= kMostSamples))
    fail(run.source, run.table.source(),
         in(run, fmt::format("{:.3g} s at up to {:g} Hz", duration_s, rate_hz)),
         fmt::format("at most {:.0f} samples of a sensor", kMostSamples));
}

/// The repetitions of one [[run]] in one session.
void plan_run(const Section& run, const Common& common, const std::string& session, Plan& plan) {
  static const std::vector<std::string> known = [] {
    std::vector<std::string> names = {"name", "repeat", "path", "slip", "random_slips"};
    names.insert(names.end(), sensor_sections().begin(), sensor_sections().end());
    return names;
  }();
  check_keys(run, known);
  const std::string name = name_in(run, "run");
  int repeat = 1;
  read_whole(run, "repeat", 1, 9999, repeat);
  for (int i = 1; i <= repeat; ++i) {
    if (plan.runs.size() >= kMostRuns)
      fail(run.source, run.table.source(), fmt::format("more than {} runs", kMostRuns),
           "fewer in all sessions");
    Common own = common;
    own.scenario.seed = Random(plan.seed, kFirstRun + plan.runs.size()).bits();
    read_sensors(run, own.scenario, own.pace);
    Random path_random(own.scenario.seed, kPathStream);
    own.scenario.path = read_path(run, own.pace, own.scenario.start, path_random);
    require_finite_run(run, own.scenario);
    read_slips(run, own.scenario);
    plan.runs.push_back(
        {repeat == 1 ? name : fmt::format("{}_{:02}", name, i), session, std::move(own.scenario)});
  }
}

void demand_different_names(const Section& file, const Plan& plan) {
  std::vector<std::string> places;
  for (const PlannedRun& run : plan.runs) places.push_back(run.session + "/" + run.name);
  std::ranges::sort(places);
  const auto twice = std::ranges::adjacent_find(places);
  if (twice != places.end())
    fail(file.source, file.table.get("run")->source(), fmt::format("two runs are named \"{}\"", *twice),
         "a different name for each");
}

void plan_sessions(const Section& file, const Common& common, Plan& plan) {
  int sessions = 1;
  read_whole(file, "sessions", 1, 9999, sessions);
  const SessionSpread spread(file, common.scenario.nominal);
  for (int i = 1; i <= sessions; ++i) {
    Common own = common;
    Random random(plan.seed, kFirstSession + static_cast<std::uint64_t>(i));
    own.scenario.truth = spread.drawn(common.scenario.truth, random);
    const std::string session = sessions == 1 ? plan.name : fmt::format("{}_{:02}", plan.name, i);
    for (const Section& run : tables(file, "run", "[[run]]")) plan_run(run, own, session, plan);
  }
  if (!plan.runs.empty()) demand_different_names(file, plan);
}

std::optional<PlannedSheet> read_sheet(const Section& file, const Common& common) {
  if (!file.table.contains("sheet")) return std::nullopt;
  PlannedSheet sheet{common.scenario, {.pace = common.pace}};
  read_options(file, "sheet", {"runs", "with_leg"}, kSheet, sheet.plan, [&](const Section& s) {
    read_whole(s, "runs", 1, 9999, sheet.plan.runs);
    read_flag(s, "with_leg", sheet.plan.with_leg);
  });
  return sheet;
}

Plan read(const Section& file, const std::filesystem::path& path, std::optional<std::uint64_t> seed) {
  static const std::vector<std::string> known = [] {
    std::vector<std::string> names = {"name",  "seed", "robot", "steering",  "whole_intervals", "sessions",
                                      "truth", "run",  "sheet", "landmarks", "session_spread",  "landmark"};
    names.insert(names.end(), sensor_sections().begin(), sensor_sections().end());
    return names;
  }();
  check_keys(file, known);
  Plan plan;
  plan.name = name_in(file, path.stem().string());
  int own_seed = 1;
  read_whole(file, "seed", 0, INT32_MAX, own_seed);
  plan.seed = seed.value_or(static_cast<std::uint64_t>(own_seed));
  const auto robot_path = path.parent_path() / text(file, "robot", "the path of a robot file");
  plan.inputs = {input_file(path), input_file(robot_path)};
  const Common common = read_common(file, read_robot(robot_path), plan.seed);
  plan_sessions(file, common, plan);
  plan.sheet = read_sheet(file, common);
  if (plan.runs.empty() && !plan.sheet)
    throw InputError(file.source.name, "no [[run]] and no [sheet]", "at least one of them");
  return plan;
}

}  // namespace
}  // namespace scenario_file

Plan read_plan(const std::filesystem::path& path, std::optional<std::uint64_t> seed) {
  const std::string content = read_file(path);
  const std::string name = path.string();
  const robot_file::Source source{content, name};
  const toml::table table = parse_toml(content, name);
  return scenario_file::read({source, table, ""}, path, seed);
}

}  // namespace trundle::simulation
