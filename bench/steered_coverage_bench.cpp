// Do the 95 % intervals of calibrated robots with steered wheels hold the truth in 95 of 100 calibrations?
// The table of docs/results/coverage-steered.md.
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/core.h>

#include "calibration/steered_drives.hpp"

namespace {

using namespace trundle::test;

constexpr std::string_view kUsage =
    "steered_coverage_bench [tricycle|car|swerve ...] [COUNT] [--blind]\n"
    "COUNT calibrations of each (1000); --blind: of drives that share no code with the simulation.\n";

void print(std::string_view kind, bool blind, int count) {
  const SteeredSeries series = steered_series(kind, blind, count);
  for (std::size_t j = 0; j < series.names.size(); ++j) {
    const auto k = static_cast<Eigen::Index>(j);
    fmt::print("| {} | {} | {:.3f} | {:+.2f} | {:.2f} |\n", kind, series.names[j], series.held[k],
               series.mean[k], series.scatter[k]);
  }
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  bool blind = false;
  int count = 1000;
  std::vector<std::string> kinds;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--blind")
      blind = true;
    else if (word == "tricycle" || word == "car" || word == "swerve")
      kinds.push_back(word);
    else
      count = std::atoi(word.c_str());
  }
  if (count < 1) {
    fmt::print("{}", kUsage);
    return 2;
  }
  if (kinds.empty()) kinds = {"tricycle", "car", "swerve"};
  fmt::print(
      "{} calibrations of each{}.\n\n| robot | parameter | intervals that hold | mean error [σ] | scatter "
      "[σ] |\n|---|---|---|---|---|\n",
      count, blind ? ", by the other simulation" : "");
  for (const std::string& kind : kinds) print(kind, blind, count);
}
