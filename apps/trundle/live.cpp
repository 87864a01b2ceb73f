#include "trundle/pipeline/live.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <limits>
#include <memory>

#include <fmt/format.h>

#include "trundle/pipeline/files.hpp"
#include "trundle/pipeline/provenance.hpp"
#include "trundle/report/json_text.hpp"

#include "command.hpp"
#include "live.hpp"
#include "slip_correction.hpp"
#include "start_pose.hpp"

namespace trundle::app {
namespace {

struct LiveArguments {
  Common common;
  std::string robot;
  std::string start = "0,0,0";
  double probability = SlipOptions{}.probability;
  double spin_odds = SlipOptions{}.spin_odds;
  double longest_step_s = AlignerOptions{}.shortest_gap_s;
  LiveSlamOptions slam;
  std::string checkpoint;
  double checkpoint_every_s = 5.0;
  std::string resume;
  bool timing = false;
};

Provenance provenance_of(const LiveArguments& options, const RobotFile& robot) {
  Provenance provenance{{robot.file},
                        {{"start", options.start},
                         {"probability", fmt::format("{}", options.probability)},
                         {"spin-odds", fmt::format("{}", options.spin_odds)},
                         {"longest-step-s", fmt::format("{}", options.longest_step_s)}},
                        std::nullopt};
  if (!robot.robot.landmark_sensor) return provenance;
  provenance.options.emplace_back("window", fmt::format("{}", options.slam.window_s));
  provenance.options.emplace_back("late-s", fmt::format("{}", options.slam.late_s));
  if (options.slam.unknown_ids) provenance.options.emplace_back("unknown-ids", "true");
  return provenance;
}

/// Lines to stdout, each as soon as it is known; with --json as the members of one document.
class Printer {
 public:
  explicit Printer(const Common& common) : common_(common) {}

  void begin(const Provenance& provenance) {
    if (!common_.json) return;
    std::string head = dumped(to_json(provenance));
    head.back() = ',';
    put(head + "\"estimates\":[\n");
  }
  void line(const std::string& text) {
    if (common_.json)
      put((any_ ? ",\n" : "") + text);
    else if (!common_.quiet)
      put(text + "\n");
    any_ = true;
  }
  void end() {
    if (common_.json) put("\n]}\n");
  }

 private:
  static void put(const std::string& text) {
    std::fwrite(text.data(), 1, text.size(), stdout);
    require_printed();
  }

  Common common_;
  bool any_ = false;
};

/// How long each line of input took, from the moment when it was read to that when its answer was out.
class Timing {
 public:
  using Clock = std::chrono::steady_clock;

  void add(Clock::duration spent) {
    spent_us_.push_back(std::chrono::duration<float, std::micro>(spent).count());
  }
  std::string text() {
    if (spent_us_.empty()) return "no line was read\n";
    std::ranges::sort(spent_us_);
    const auto quantile = [&](double p) {
      return spent_us_[static_cast<std::size_t>(p * static_cast<double>(spent_us_.size() - 1))];
    };
    return fmt::format("{} lines; time for one: median {:.1f} µs, p99 {:.1f} µs, most {:.1f} µs\n",
                       spent_us_.size(), quantile(0.5), quantile(0.99), quantile(1.0));
  }

 private:
  std::vector<float> spent_us_;
};

/// Lines in, lines out, and what is stored on the way.
class Session {
 public:
  Session(const LiveArguments& options, const RobotFile& robot)
      : options_(options),
        robot_(robot.robot),
        provenance_(provenance_of(options, robot)),
        settings_(dumped(to_json(provenance_))),
        printer_(options.common),
        odometer_(robot.robot, {.start = start_pose_from(options.start),
                                .slip = {.probability = options.probability, .spin_odds = options.spin_odds},
                                .alignment = {.shortest_gap_s = options.longest_step_s},
                                .slam = options.slam}) {}

  void run(std::istream& input) {
    if (!options_.resume.empty()) read_live_checkpoint(options_.resume, settings_, odometer_);
    repeats_ = !options_.resume.empty();
    printer_.begin(provenance_);
    std::string line;
    while (read_line(input, line)) {
      const auto begin = Timing::Clock::now();
      ++lines_in_;
      if (!line.empty()) take(line);
      store_if_due();
      if (options_.timing) timing_.add(Timing::Clock::now() - begin);
    }
    const LiveOdometer waiting = odometer_;  // as one that goes on needs it
    finish();
    printer_.end();
    store(waiting);
    if (options_.timing) print_error(timing_.text());
  }

  /// Lines that were left out, checkpoints that were not stored: each has been told.
  std::size_t problems() const { return problems_; }

 private:
  /// The next line; false at the end of the input, and where it has no line ends: memory is finite.
  bool read_line(std::istream& input, std::string& line) {
    constexpr std::size_t kLongestLine = 1 << 20;  // bytes
    line.clear();
    for (char c; input.get(c);) {
      if (c == '\n') return true;
      line += c;
      if (line.size() <= kLongestLine) continue;
      tell(InputError(io::place("stdin", lines_in_ + 1), "a line of more than a million bytes",
                      "lines of one reading each"));
      return false;
    }
    return !line.empty();
  }

  /// A line that is wrong is named and left out: a robot does not lose its pose for it.
  void take(const std::string& text) {
    const std::string place = io::place("stdin", lines_in_);
    try {
      const LiveLine line = parse_live_line(text, place);
      if (repeats_ && odometer_.is_known(line)) return;
      odometer_.take(line, place, estimates_);
      repeats_ = false;
      last_s_ = line.time_s;
      print_estimates();
      if (line.wants_map) printer_.line(pipeline::line_of(line.time_s, odometer_.map()));
      return;
    } catch (const InputError& error) {
      tell(error);
    } catch (const CannotAnswer& error) {
      tell(error);
    }
    print_estimates();
  }

  void finish() {
    try {
      odometer_.finish(estimates_);
    } catch (const CannotAnswer& error) {
      tell(error);
    }
    print_estimates();
  }

  void tell(const std::exception& error) {
    ++problems_;
    print_error(fmt::format("trundle: {}\n", error.what()));
  }

  void print_estimates() {
    for (const LiveSighted& sighted : odometer_.take_sighted()) printer_.line(pipeline::line_of(sighted));
    for (const LiveEstimate& estimate : estimates_) printer_.line(line_of(estimate, robot_));
    estimates_.clear();
  }

  void store_if_due() {
    if (!(std::abs(last_s_ - stored_s_) >= options_.checkpoint_every_s)) return;
    stored_s_ = last_s_;
    store(odometer_);
  }

  /// Where that fails the answers go on: the robot drives.
  void store(const LiveOdometer& odometer) {
    if (options_.checkpoint.empty()) return;
    try {
      write_live_checkpoint(options_.checkpoint, settings_, odometer);
    } catch (const InputError& error) {
      tell(error);
    }
  }

  LiveArguments options_;
  Robot robot_;
  Provenance provenance_;
  std::string settings_;
  Printer printer_;
  LiveOdometer odometer_;
  Timing timing_;
  std::vector<LiveEstimate> estimates_;
  std::size_t lines_in_ = 0;
  std::size_t problems_ = 0;
  bool repeats_ = false;  ///< after a resume, while the input repeats what is known
  double last_s_ = std::numeric_limits<double>::quiet_NaN();   ///< stamp of the last line that was taken
  double stored_s_ = std::numeric_limits<double>::infinity();  ///< and of the last stored: the first one is
};

void run(const LiveArguments& options) {
  const RobotFile robot = read_robot_file(options.robot);
  require_apart({robot.file}, {options.checkpoint});
  Session session(options, robot);
  session.run(std::cin);
  if (session.problems() > 0) throw Exit{kBadInput};  // told of already
}

}  // namespace

void add_live(CLI::App& app) {
  auto options = std::make_shared<LiveArguments>();
  CLI::App* command =
      add_command(app, "live", "Pose, covariance and slip as the readings come, line by line",
                  "trundle live --robot robot.toml --checkpoint state < readings.jsonl", options->common);
  command->add_option("--robot", options->robot, "Robot file")->required();
  command->add_option("--start", options->start, "Pose at the first reading: X,Y,DEG [m, m, degrees]")
      ->capture_default_str();
  command->add_option("--probability", options->probability, "That an interval without slip is flagged")
      ->check(number_from(1e-12, 0.5))
      ->capture_default_str();
  add_spin_odds(*command, options->spin_odds);
  command
      ->add_option("--longest-step-s", options->longest_step_s,
                   "Longer steps of a stream are gaps; a gyro silent for longer is not waited for [s]")
      ->check(number_from(kSmallest, kLargest))
      ->capture_default_str();
  command
      ->add_option("--window", options->slam.window_s,
                   "With sightings: marginalise poses that are older, so that memory and the time of a line "
                   "stay bounded [s]")
      ->check(number_from(0.0, kLargest))
      ->capture_default_str();
  command
      ->add_option("--late-s", options->slam.late_s,
                   "So much later than its stamp a sighting may come; the map waits so long for it [s]")
      ->check(number_from(0.0, 60.0))
      ->capture_default_str();
  command->add_flag("--unknown-ids", options->slam.unknown_ids,
                    "Forget the landmarks' names and find out which is which");
  CLI::Option* checkpoint =
      command->add_option("--checkpoint", options->checkpoint, "File to store the state in, as it runs");
  command->add_option("--checkpoint-every-s", options->checkpoint_every_s, "How often, by the stamps [s]")
      ->check(number_from(0.0, kLargest))
      ->needs(checkpoint)
      ->capture_default_str();
  command->add_option("--resume", options->resume,
                      "Go on from such a file; input that it has seen already is passed over");
  command->add_flag("--timing", options->timing, "At the end, on stderr: how long a line took");
  command->callback([options] { run(*options); });
}

}  // namespace trundle::app
