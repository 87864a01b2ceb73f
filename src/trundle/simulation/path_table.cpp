#include "trundle/simulation/detail/path_table.hpp"

namespace trundle::simulation::scenario_file {
namespace {

/// The numbers that steps of a path may have.
struct Step {
  double duration_s = 0.0;
  double length_m = 0.0;
  double angle_rad = 0.0;
  double side_m = 0.0;
  double radius_m = 0.0;
  double turns = 1.0;
};

constexpr Range kTurns{[](double v) { return v > 0.0 && v <= 1000.0; }, "turns above 0, at most 1000"};
constexpr Range kLength{[](double v) { return std::abs(v) <= 1e5; }, "metres between -100000 and 100000"};
constexpr Range kSize{[](double v) { return v > 0.0 && v <= 1e5; }, "metres above 0, at most 100000"};
/// In a smaller one a tour would be turns alone.
constexpr Range kTourSize{[](double v) { return v >= 0.1 && v <= 1e5; }, "metres between 0.1 and 100000"};
constexpr Range kWithinHalfTurn{[](double v) { return std::abs(v) <= 0.99 * kPi; },
                                "degrees between -178.2 and 178.2"};

constexpr std::array kDurationOf{NumberKey<Step>{
    "duration_s", [](Step& s) -> double& { return s.duration_s; }, kDuration, Presence::required}};
constexpr std::array kLengthOf{
    NumberKey<Step>{"length_m", [](Step& s) -> double& { return s.length_m; }, kLength, Presence::required}};
constexpr std::array kAngleOf{NumberKey<Step>{"angle_deg", [](Step& s) -> double& { return s.angle_rad; },
                                              kWithinHalfTurn, Presence::required}};
constexpr std::array kSideOf{
    NumberKey<Step>{"side_m", [](Step& s) -> double& { return s.side_m; }, kSize, Presence::required}};
constexpr std::array kRadiusOf{
    NumberKey<Step>{"radius_m", [](Step& s) -> double& { return s.radius_m; }, kSize, Presence::required}};
constexpr std::array kTurnsOf{NumberKey<Step>{"turns", [](Step& s) -> double& { return s.turns; }, kTurns}};

constexpr std::array kTour{
    NumberKey<Tour>{"length_m", [](Tour& t) -> double& { return t.length_m; }, kSize, Presence::required},
    NumberKey<Tour>{"box_x_m", [](Tour& t) -> double& { return t.box_x_m; }, kTourSize},
    NumberKey<Tour>{"box_y_m", [](Tour& t) -> double& { return t.box_y_m; }, kTourSize},
    NumberKey<Tour>{"longest_segment_m", [](Tour& t) -> double& { return t.longest_segment_m; }, kTourSize},
    NumberKey<Tour>{"sharpest_1_m", [](Tour& t) -> double& { return t.sharpest_1_m; }, kNotNegative},
    NumberKey<Tour>{"pause_share", [](Tour& t) -> double& { return t.pause_share; }, kShare},
};

/// Reads one step: checks its keys, then takes its numbers. `pace` may be changed for this step alone.
class StepReader {
 public:
  StepReader(const Section& section, const Pace& pace) : section_(section), pace_(pace) {}

  template <class... Keys>
  Step numbers(std::vector<std::string> others, const Keys&... keys) {
    others.insert(others.end(), {"drive"});
    check_keys(section_, names_with(std::move(others), kPace, keys...));
    read_numbers(section_, kPace, pace_);
    Step step;
    (read_numbers(section_, keys, step), ...);
    return step;
  }

  TurnSense sense() const {
    static const std::vector<std::string> words = {"ccw", "cw"};
    if (!section_.table.contains("turn")) return TurnSense::ccw;
    return read_word(section_, "turn", words) == 0 ? TurnSense::ccw : TurnSense::cw;
  }

  bool flag(std::string_view key) const {
    bool value = false;
    read_flag(section_, key, value);
    return value;
  }

  Tour tour() {
    check_keys(section_, names_with({"drive", "sideways"}, kPace, kTour));
    read_numbers(section_, kPace, pace_);
    Tour tour;
    read_numbers(section_, kTour, tour);
    tour.sideways = flag("sideways");
    return tour;
  }

  std::vector<Vector2> points() const {
    constexpr std::string_view kExpectation = "points: [[x, y], ...] in metres";
    const toml::node& node = required(section_, "points", kExpectation);
    std::vector<Vector2> points;
    const toml::array* array = node.as_array();
    if (array == nullptr)
      fail(section_.source, node.source(), in(section_, "points is no array"), kExpectation);
    for (const toml::node& point : *array) points.push_back(point_of(point, kExpectation));
    return points;
  }

  const Pace& pace() const { return pace_; }
  const Section& section() const { return section_; }

 private:
  Vector2 point_of(const toml::node& node, std::string_view expectation) const {
    const toml::array* pair = node.as_array();
    if (pair == nullptr || pair->size() != 2)
      fail(section_.source, node.source(), in(section_, "a point is no pair"), expectation);
    return {number(section_.source, "x", *pair->get(0), kLength),
            number(section_.source, "y", *pair->get(1), kLength)};
  }

  const Section& section_;
  Pace pace_;
};

struct Surroundings {
  Pose2 pose;  ///< where the step begins
  Random& random;
};

using ReadStep = Path (*)(StepReader&, const Surroundings&);

Path read_straight(StepReader& reader, const Surroundings&) {
  const Step step = reader.numbers({}, kLengthOf);
  return straight(step.length_m, reader.pace());
}

Path read_pause(StepReader& reader, const Surroundings&) {
  return pause(reader.numbers({}, kDurationOf).duration_s);
}

Path read_turn(StepReader& reader, const Surroundings&) {
  const Step step = reader.numbers({}, kAngleOf);
  return turn_on_the_spot(step.angle_rad, reader.pace());
}

Path read_arc(StepReader& reader, const Surroundings&) {
  const Step step = reader.numbers({}, kLengthOf, kAngleOf);
  Path path = straight(step.length_m, reader.pace());
  for (Segment& segment : path) segment.motion.dtheta = step.angle_rad;
  return path;
}

Path read_square(StepReader& reader, const Surroundings&) {
  const Step step = reader.numbers({"turn"}, kSideOf);
  return square(step.side_m, reader.sense(), reader.pace());
}

Path read_l_run(StepReader& reader, const Surroundings&) {
  const Step step = reader.numbers({"turn", "sideways"}, kSideOf);
  const auto build = reader.flag("sideways") ? l_run : l_run_with_turn;
  return build(step.side_m, reader.sense(), reader.pace());
}

Path read_circle(StepReader& reader, const Surroundings&) {
  const Step step = reader.numbers({"turn"}, kRadiusOf, kTurnsOf);
  return circle(step.radius_m, step.turns, reader.sense(), reader.pace());
}

Path read_figure_eight(StepReader& reader, const Surroundings&) {
  const Step step = reader.numbers({}, kRadiusOf);
  return figure_eight(step.radius_m, reader.pace());
}

Path read_waypoints(StepReader& reader, const Surroundings& around) {
  reader.numbers({"points"});
  return waypoints(around.pose, reader.points(), reader.pace());
}

Path read_tour(StepReader& reader, const Surroundings& around) {
  const Tour tour = reader.tour();
  return random_tour(tour, around.pose, around.random, reader.pace());
}

struct StepKind {
  const char* word;
  ReadStep read;
};

constexpr StepKind kSteps[] = {
    {"straight", read_straight},   {"pause", read_pause},
    {"turn", read_turn},           {"arc", read_arc},
    {"square", read_square},       {"l_run", read_l_run},
    {"circle", read_circle},       {"tour", read_tour},
    {"waypoints", read_waypoints}, {"figure_eight", read_figure_eight},
};

std::vector<std::string> words_of_steps() {
  std::vector<std::string> words;
  for (const StepKind& kind : kSteps) words.emplace_back(kind.word);
  return words;
}

}  // namespace

Path read_path(const Section& run, const Pace& pace, const Pose2& start, Random& random) {
  static const std::vector<std::string> words = words_of_steps();
  Path path;
  for (const Section& section : tables(run, "path", "[[run.path]]")) {
    StepReader reader(section, pace);
    const std::size_t kind = read_word(section, "drive", words);
    const Path step = kSteps[kind].read(reader, {end_of(path, start), random});
    path.insert(path.end(), step.begin(), step.end());
  }
  if (path.empty())
    fail(run.source, run.table.source(), in(run, "nothing to drive"), "at least one [[run.path]] with a way");
  return path;
}

}  // namespace trundle::simulation::scenario_file
