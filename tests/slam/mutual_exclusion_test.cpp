#include "trundle/slam/fastslam/mutual_exclusion.hpp"

#include <algorithm>

#include <gtest/gtest.h>

#include "trundle/statistics/random.hpp"

namespace trundle::slam {
namespace {

constexpr std::size_t kFewParticles = 40;
constexpr double kNew = 17.0;

/// Of a sighting of one of these landmarks: some far, some near, the rest with costs around that of a new
/// one.
Hypotheses some_hypotheses(const std::vector<LandmarkId>& landmarks, Random& random) {
  Hypotheses sighting;
  sighting.reset(kFewParticles);
  for (const LandmarkId landmark : landmarks) sighting.add({landmark, nullptr});
  for (double& cost : sighting.costs) {
    const double kind = random.uniform(0.0, 1.0);
    cost = kind < 0.2 ? kFar : kind < 0.3 ? kNear : random.uniform(-5.0, 20.0);
  }
  return sighting;
}

/// What the particle takes the sighting for if it takes the likeliest.
std::int32_t likeliest(const Hypotheses& sighting, std::size_t particle) {
  double least = kNew;
  std::int32_t choice = kNewLandmark;
  for (std::size_t c = 0; c < sighting.candidates.size(); ++c) {
    if (sighting.costs_of(c)[particle] == kNear && choice == kNewLandmark) choice = kAmbiguousLandmark;
    if (sighting.costs_of(c)[particle] >= least) continue;
    least = sighting.costs_of(c)[particle];
    choice = static_cast<std::int32_t>(sighting.candidates[c].landmark);
  }
  return choice;
}

/// The cheapest of all ways to give the sightings different landmarks, or none.
class AllWays {
 public:
  AllWays(const std::vector<Hypotheses>& sightings, std::size_t particle)
      : sightings_(sightings), particle_(particle) {
    try_from(0, 0.0);
  }
  const std::vector<std::int32_t>& cheapest() const { return cheapest_; }

 private:
  void try_from(std::size_t k, double cost) {
    if (k == sightings_.size()) {
      if (cost < least_) cheapest_ = way_;
      least_ = std::min(least_, cost);
      return;
    }
    const Hypotheses& sighting = sightings_[k];
    std::int32_t none = kNewLandmark;
    for (std::size_t c = 0; c < sighting.candidates.size(); ++c) {
      const double more = sighting.costs_of(c)[particle_];
      const auto landmark = static_cast<std::int32_t>(sighting.candidates[c].landmark);
      if (more == kNear) none = kAmbiguousLandmark;
      if (more >= kFar || std::ranges::find(way_, landmark) != way_.end()) continue;
      take(k, landmark, cost + more);
    }
    take(k, none, cost + kNew);
  }
  void take(std::size_t k, std::int32_t choice, double cost) {
    way_.push_back(choice);
    try_from(k + 1, cost);
    way_.pop_back();
  }

  const std::vector<Hypotheses>& sightings_;
  std::size_t particle_;
  double least_ = 1e300;
  std::vector<std::int32_t> way_, cheapest_;
};

std::vector<std::int32_t> choices_of(const std::vector<Hypotheses>& sightings, std::size_t particle) {
  std::vector<std::int32_t> choices;
  for (const Hypotheses& sighting : sightings) choices.push_back(sighting.choices[particle]);
  return choices;
}

bool takes_one_twice(std::vector<std::int32_t> choices) {
  std::ranges::sort(choices);
  const auto twice = std::ranges::adjacent_find(
      choices, [](std::int32_t one, std::int32_t other) { return one == other && one >= 0; });
  return twice != choices.end();
}

void apply_to(std::vector<Hypotheses>& sightings, MutualExclusion& exclusion) {
  std::vector<Hypotheses*> all;
  for (Hypotheses& sighting : sightings) all.push_back(&sighting);
  exclusion.apply(all, kFewParticles);
}

TEST(MutualExclusion, IsTheCheapestOfAllWaysWhereOneIsTakenTwice) {
  Random random(1);
  MutualExclusion exclusion(kNew);
  int decided = 0;
  for (std::size_t run = 0; run < 200; ++run) {
    std::vector<LandmarkId> landmarks = {7, 3, 11, 0};
    landmarks.resize(1 + random.below(4));
    std::vector<Hypotheses> sightings;
    for (std::size_t k = 0; k < 2 + run % 4; ++k) sightings.push_back(some_hypotheses(landmarks, random));
    for (std::size_t i = 0; i < kFewParticles; ++i)
      for (Hypotheses& sighting : sightings) sighting.choices[i] = likeliest(sighting, i);
    const std::vector<Hypotheses> before = sightings;
    apply_to(sightings, exclusion);
    for (std::size_t i = 0; i < kFewParticles; ++i) {
      const bool decides = takes_one_twice(choices_of(before, i));
      decided += decides ? 1 : 0;
      ASSERT_EQ(choices_of(sightings, i), decides ? AllWays(before, i).cheapest() : choices_of(before, i));
    }
  }
  EXPECT_GT(decided, 2000);
}

TEST(MutualExclusion, TakesInWhoeverMaySeeTheSame) {
  // Two have been taken for 1. The second could be 2 instead, if the third were not likelier to be that. The
  // fourth has nothing to do with them.
  std::vector<Hypotheses> sightings(4);
  const std::vector<std::vector<LandmarkId>> landmarks = {{1}, {1, 2}, {2}, {9}};
  const std::vector<std::vector<double>> costs = {{1.0}, {2.0, 3.0}, {-10.0}, {5.0}};
  for (std::size_t k = 0; k < sightings.size(); ++k) {
    sightings[k].reset(kFewParticles);
    for (std::size_t c = 0; c < landmarks[k].size(); ++c) {
      sightings[k].add({landmarks[k][c], nullptr});
      std::fill_n(sightings[k].costs_of(c), kFewParticles, costs[k][c]);
    }
    std::ranges::fill(sightings[k].choices, kNewLandmark);
  }
  sightings[0].choices[5] = sightings[1].choices[5] = 1;
  MutualExclusion exclusion(kNew);
  apply_to(sightings, exclusion);
  for (std::size_t i = 0; i < kFewParticles; ++i)
    EXPECT_EQ(choices_of(sightings, i), i == 5 ? (std::vector<std::int32_t>{1, kNewLandmark, 2, kNewLandmark})
                                               : std::vector<std::int32_t>(4, kNewLandmark));
}

}  // namespace
}  // namespace trundle::slam
