// How long finding the pose without names takes, by the size of the map and by how alike its places are: a
// robot wanders for 30 s, looks around twice a second and sees twelve landmarks, 0.1 m and 1° rms, up to 8 m
// away.
//   random  nowhere alike, a landmark every 4 m²
//   odd     a grid of 2 m in which a tenth of the landmarks is missing
//   rooms   of 6 m with the same eight landmarks; in every fourth one of them is missing
//   grid    of 2 m: nothing tells its places apart but where it ends
// `found`: right after 30 s, of so many worlds; `wrong`: a pose was claimed that was not right.
//   global_search_bench [worlds, default 10 [landmarks, default 100 300 1000 2000]]
#include <chrono>
#include <cstdlib>

#include <fmt/format.h>

#include "../tests/slam/field.hpp"

namespace {

using namespace trundle::pipeline;
namespace test = trundle::test;

enum class Layout { random, odd, rooms, grid };
constexpr const char* kNames[] = {"random", "odd", "rooms", "grid"};

std::vector<Vector2> grid_of(int count, double share, Random& random) {
  std::vector<Vector2> places;
  const int side = static_cast<int>(std::lround(std::sqrt(count / share)));
  for (int i = 0; i < side * side; ++i)
    if (random.uniform() < share) places.push_back({2.0 * (i % side), 2.0 * (i / side)});
  return places;
}

std::vector<Vector2> rooms_of(int count, Random& random) {
  constexpr double kRoom_m = 6.0;
  constexpr int kInRoom = 8;
  std::vector<Vector2> room;
  for (int i = 0; i < kInRoom; ++i) room.push_back({random.uniform(0.3, 5.7), random.uniform(0.3, 5.7)});
  const int side = static_cast<int>(std::lround(std::sqrt(static_cast<double>(count) / kInRoom)));
  std::vector<Vector2> places;
  for (int r = 0; r < side * side; ++r) {
    const auto missing = random.below(4) == 0 ? random.below(kInRoom) : kInRoom;
    for (std::size_t i = 0; i < room.size(); ++i)
      if (i != missing) places.push_back(room[i] + kRoom_m * Vector2(r % side, r / side));
  }
  return places;
}

test::FieldOptions field_of(Layout layout, int count, std::uint64_t seed) {
  Random random(seed, 11);
  test::FieldOptions options{.landmarks = count, .seen_at_once = 12, .seed = seed};
  options.side_m = 2.0 * std::sqrt(static_cast<double>(count));
  if (layout == Layout::odd) options.layout = grid_of(count, 0.9, random);
  if (layout == Layout::rooms) options.layout = rooms_of(count, random);
  if (layout == Layout::grid) options.layout = grid_of(count, 1.0, random);
  for (const Vector2& place : options.layout) options.side_m = std::max(place.maxCoeff(), 1.0);
  return options;
}

struct Score {
  int found = 0;
  int wrong = 0;
  double seconds = 0.0;
  double longest_s = 0.0;

  void add(const test::FieldOptions& options) {
    test::Field field(options);
    Localizer localizer(field.map(), field.sensor(), {});
    bool is_wrong = false;
    for (int k = 0; k < 300; ++k) {
      const SlamStep step = field.step(false);
      const auto start = std::chrono::steady_clock::now();
      localizer.step(step.motion, step.observations);
      const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
      seconds += took.count();
      longest_s = std::max(longest_s, took.count());
      is_wrong = is_wrong || (localizer.estimate() && !test::is_right(localizer.estimate(), field.truth()));
    }
    wrong += is_wrong ? 1 : 0;
    found += test::is_right(localizer.estimate(), field.truth()) ? 1 : 0;
  }
};

}  // namespace

int main(int argc, char** argv) {
  const int worlds = argc > 1 ? std::atoi(argv[1]) : 10;
  std::vector<int> counts;
  for (int i = 2; i < argc; ++i) counts.push_back(std::atoi(argv[i]));
  if (counts.empty()) counts = {100, 300, 1000, 2000};
  fmt::print("{:<10}{:>10}{:>8}{:>8}{:>12}{:>18}\n", "layout", "landmarks", "found", "wrong", "30 s [s]",
             "longest step [s]");
  for (const Layout layout : {Layout::random, Layout::odd, Layout::rooms, Layout::grid})
    for (const int count : counts) {
      Score score;
      for (int world = 1; world <= worlds; ++world)
        score.add(field_of(layout, count, static_cast<std::uint64_t>(world)));
      fmt::print("{:<10}{:>10}{:>8}{:>8}{:>12.3f}{:>18.3f}\n", kNames[static_cast<int>(layout)], count,
                 score.found, score.wrong, score.seconds / worlds, score.longest_s);
      std::fflush(stdout);
    }
}
