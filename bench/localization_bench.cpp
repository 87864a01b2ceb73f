// Finding the way on a known map, in simulated fields of landmarks: how often the pose is right after so many
// sightings and stays right for 20 s, from nowhere and after the robot was carried away; how often a pose
// that was claimed was wrong; how often a robot that is not lost is thought to be.
//   localization_bench [worlds, default 200 [hours without being carried away, default 10]]
#include <cstdlib>

#include <Eigen/Cholesky>
#include <fmt/format.h>

#include "../tests/slam/field.hpp"

namespace {

using namespace trundle::pipeline;
namespace test = trundle::test;

constexpr int kTwentySeconds = 200;  // steps

struct Setting {
  LocalizerFilter filter;
  bool named;

  int enough() const { return named ? 10 : 30; }  // sightings
};

/// A robot in a field, and what it believes.
class Trial {
 public:
  Trial(const test::FieldOptions& options, const Setting& setting)
      : field_(options),
        localizer_(field_.map(), field_.sensor(), {.filter = setting.filter}),
        setting_(setting) {}

  /// Whether the pose is right once enough was seen, and for 20 s after.
  bool finds_and_keeps() {
    int seen = 0;
    while (seen < setting_.enough()) seen += step();
    bool right = is_right();
    for (int k = 0; k < kTwentySeconds && right; ++k) {
      step();
      right = is_right();
    }
    return right;
  }
  /// Carries it away; the sightings until that is noticed, nothing if it is not within a minute.
  std::optional<int> sightings_until_noticed() {
    for (int k = 0; k < 300; ++k) step();
    field_.carry_away();
    while (is_right()) step();
    int seen = 0;
    for (int k = 0; k < 600; ++k) {
      if (!localizer_.estimate()) return seen;
      seen += step();
    }
    return std::nullopt;
  }
  /// Alarms over so many hours.
  int alarms_in(double hours) {
    for (int k = 0; k < 1000; ++k) step();
    int alarms = 0;
    for (int k = 0; k < hours * 36'000; ++k) alarms += step_phase() == LocalizerPhase::lost ? 1 : 0;
    return alarms;
  }
  bool claimed_wrongly() const { return claimed_wrongly_; }

 private:
  bool is_right() const { return test::is_right(localizer_.estimate(), field_.truth()); }
  /// The truth is inside the ellipsoid that holds 99.9 %.
  bool is_covered() const {
    const PoseEstimate estimate = *localizer_.estimate();
    const Pose2& truth = field_.truth();
    const Vector3 apart(truth.x - estimate.pose.x, truth.y - estimate.pose.y,
                        wrap_angle(truth.heading - estimate.pose.heading));
    return apart.dot(estimate.covariance.ldlt().solve(apart)) < 16.27;
  }
  LocalizerPhase step_phase() {
    const SlamStep step = field_.step(setting_.named);
    seen_ = static_cast<int>(step.observations.size());
    const LocalizerPhase phase = localizer_.step(step.motion, step.observations).phase;
    if (phase == LocalizerPhase::found && !is_covered()) claimed_wrongly_ = true;
    return phase;
  }
  int step() {
    step_phase();
    return seen_;
  }

  test::Field field_;
  Localizer localizer_;
  Setting setting_;
  int seen_ = 0;
  bool claimed_wrongly_ = false;
};

struct Scores {
  int found = 0, claimed_wrongly = 0, noticed = 0, found_again = 0;
  std::vector<int> until_noticed = {};
};

Scores scores_of(test::FieldOptions field, const Setting& setting, int worlds) {
  Scores scores;
  for (int world = 1; world <= worlds; ++world) {
    field.seed = static_cast<std::uint64_t>(world);
    Trial lost(field, setting);
    scores.found += lost.finds_and_keeps() ? 1 : 0;
    scores.claimed_wrongly += lost.claimed_wrongly() ? 1 : 0;
    Trial carried(field, setting);
    const auto noticed = carried.sightings_until_noticed();
    if (!noticed) continue;
    ++scores.noticed;
    scores.until_noticed.push_back(*noticed);
    scores.found_again += carried.finds_and_keeps() ? 1 : 0;
  }
  std::ranges::sort(scores.until_noticed);
  return scores;
}

void print_table(const char* title, const test::FieldOptions& field, int worlds) {
  fmt::print("{}, {} worlds\n{:<24}{:>8}{:>16}{:>10}{:>22}{:>14}\n", title, worlds, "", "found",
             "claimed wrongly", "noticed", "sightings to notice", "found again");
  for (const LocalizerFilter filter : {LocalizerFilter::ekf, LocalizerFilter::particles})
    for (const bool named : {true, false}) {
      const Scores s = scores_of(field, {filter, named}, worlds);
      fmt::print("{:<24}{:>8}{:>16}{:>10}{:>15} ({:>4}){:>14}\n",
                 fmt::format("{}, {}", name_of(filter), named ? "names" : "no names"), s.found,
                 s.claimed_wrongly, s.noticed,
                 s.until_noticed.empty() ? 0 : s.until_noticed[s.until_noticed.size() / 2],
                 s.until_noticed.empty() ? 0 : s.until_noticed.back(), s.found_again);
    }
}

void print_alarms(double hours) {
  for (const double outliers : {0.02, 0.05})
    for (const LocalizerFilter filter : {LocalizerFilter::ekf, LocalizerFilter::particles})
      for (const bool named : {true, false}) {
        Trial trial({.outlier_share = outliers, .seed = 3}, {filter, named});
        fmt::print("false alarms in {} h, {:.0f} % outliers, {}, {}: {}\n", hours, 100.0 * outliers,
                   name_of(filter), named ? "names" : "no names", trial.alarms_in(hours));
      }
}

}  // namespace

int main(int argc, char** argv) {
  const int worlds = argc > 1 ? std::atoi(argv[1]) : 200;
  const double hours = argc > 2 ? std::atof(argv[2]) : 10.0;
  print_table("30 landmarks on 30 m x 30 m, 2 % outliers", {}, worlds);
  print_table("the same, 20 % outliers", {.outlier_share = 0.2}, worlds);
  print_table("120 landmarks on 60 m x 60 m, 2 % outliers", {.landmarks = 120, .side_m = 60.0}, worlds);
  if (hours > 0) print_alarms(hours);
}
