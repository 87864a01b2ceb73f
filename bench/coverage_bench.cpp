// Whether odometry's end pose is unbiased and its covariance honest, for every chassis, sampling rate, wheel
// noise, count and motion: the tables of docs/results/coverage.md.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <iterator>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/core.h>

#include "coverage/coverage.hpp"

namespace {

using namespace trundle::pipeline;
using namespace trundle::coverage;

constexpr std::string_view kUsageText =
    "coverage_bench [SEEDS] [--seeds N] [--chassis NAME] [--rate HZ] [--k M_PER_SQRT_M] [--counts N]\n"
    "               [--motion NAME] [--cells]\n"
    "A filter may be any value, also one that is not in the matrix; with --cells, or fewer than 50 of them, "
    "each cell is\n"
    "printed.\n";

struct Arguments {
  int seeds = 100;
  bool cells = false;
  std::map<std::string, std::string> filter;
};

std::optional<Arguments> read(int argc, char** argv) {
  Arguments arguments;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--cells") {
      arguments.cells = true;
    } else if (!word.starts_with("--")) {
      arguments.seeds = std::atoi(word.c_str());
    } else if (i + 1 == argc) {
      return {};
    } else if (word == "--seeds") {
      arguments.seeds = std::atoi(argv[++i]);
    } else if (word == "--chassis" || word == "--rate" || word == "--k" || word == "--counts" ||
               word == "--motion") {
      arguments.filter[word] = argv[++i];
    } else {
      return {};
    }
  }
  if (arguments.seeds < 2) return {};
  return arguments;
}

/// The values along one axis of the matrix: all, or the one asked for.
template <class Values>
std::vector<double> numbers(const Arguments& arguments, const std::string& key, const Values& all) {
  const auto found = arguments.filter.find(key);
  if (found == arguments.filter.end()) return {all.begin(), all.end()};
  return {std::atof(found->second.c_str())};
}
template <class Values>
std::vector<std::size_t> names(const Arguments& arguments, const std::string& key, const Values& all) {
  const auto found = arguments.filter.find(key);
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (found == arguments.filter.end() || found->second == all[i]) kept.push_back(i);
  }
  return kept;
}

std::vector<Cell> matrix(const Arguments& arguments) {
  std::vector<Cell> cells;
  for (const std::size_t chassis : names(arguments, "--chassis", kChassis))
    for (const double rate : numbers(arguments, "--rate", kRates))
      for (const double k : numbers(arguments, "--k", kNoises))
        for (const double counts : numbers(arguments, "--counts", kCounts))
          for (const std::size_t motion : names(arguments, "--motion", kMotions))
            cells.push_back({kChassis.at(chassis), rate, k, counts, static_cast<Motion>(motion), false});
  return cells;
}

/// Every chassis with a gyro, counts at which rounding shows, and motions with and without further rests.
std::vector<Cell> learning_matrix() {
  std::vector<Cell> cells;
  for (const std::string_view chassis : kChassis)
    for (const double rate : kRates)
      for (const double counts : {100.0, 1000.0})
        for (const Motion motion : {Motion::straight, Motion::stop_and_go})
          if (has_gyro(chassis)) cells.push_back({chassis, rate, 0.005, counts, motion, true});
  return cells;
}

struct Result {
  Cell cell;
  Tally tally;
};

struct Results {
  std::vector<Result> cells;
  Limits limit;
};

bool outside(const Result& result, const Limits& limit) {
  return !unbiased(result.tally, limit) || !honest(result.tally, limit);
}

void print_header() {
  fmt::print(
      "| chassis | rate [Hz] | k [m/√m] | counts | motion | along [σ] | across [σ] | turn [σ] | NEES | "
      "outside |\n"
      "|---|---|---|---|---|---|---|---|---|---|\n");
}

void print(const Result& result, const Limits& limit) {
  const auto& [cell, tally] = result;
  const Vector3 bias = tally.bias();
  fmt::print("| {} | {} | {} | {} | {} | {:+.2f} | {:+.2f} | {:+.2f} | {:.3g} | {}{} |\n", cell.chassis,
             cell.rate_hz, cell.k, cell.counts, name_of(cell.motion), bias.x(), bias.y(), bias.z(),
             tally.nees(), unbiased(tally, limit) ? "" : "bias ", honest(tally, limit) ? "" : "NEES");
  std::fflush(stdout);
}

Results run(const std::vector<Cell>& cells, int seeds, bool each) {
  Results results{{}, limits(seeds, cells.size())};
  fmt::print("{} cells of {} drives. Limits: bias {:.2f} σ, NEES {:.2f} to {:.2f}.\n\n", cells.size(), seeds,
             results.limit.bias, results.limit.nees_low, results.limit.nees_high);
  if (each) print_header();
  for (const Cell& cell : cells) {
    results.cells.push_back({cell, run_cell(cell, seeds)});
    if (each) print(results.cells.back(), results.limit);
  }
  return results;
}

/// What a table shows of the cells that fall into one place of it.
std::string bias_of(const std::vector<Result>& cells) {
  double mean = 0.0;
  double largest = 0.0;
  for (const Result& cell : cells) {
    const double along = cell.tally.bias().x();
    mean += along / static_cast<double>(cells.size());
    if (std::abs(along) > std::abs(largest)) largest = along;
  }
  return fmt::format("{:+.2f} ({:+.2f})", mean, largest);
}

std::string short_number(double value) {
  return value < 99.5 ? fmt::format("{:.2g}", value) : fmt::format("{:.0f}", value);
}

std::string nees_of(const std::vector<Result>& cells) {
  double mean = 0.0;
  double low = cells.front().tally.nees();
  double high = low;
  for (const Result& cell : cells) {
    const double nees = cell.tally.nees();
    mean += nees / static_cast<double>(cells.size());
    low = std::min(low, nees);
    high = std::max(high, nees);
  }
  return fmt::format("{} ({} to {})", short_number(mean), short_number(low), short_number(high));
}

template <class T>
std::vector<T> values_of(const std::vector<Result>& cells, T Cell::*member) {
  std::vector<T> values;
  for (const Result& result : cells) {
    if (std::ranges::find(values, result.cell.*member) == values.end()) {
      values.push_back(result.cell.*member);
    }
  }
  return values;
}

/// A row for each value of `member`, a column for each rate.
template <class T, class Show>
void print_by_rate(const std::vector<Result>& cells, T Cell::*member, std::string_view corner, Show show) {
  const std::vector<double> rates = values_of(cells, &Cell::rate_hz);
  fmt::print("| {} |", corner);
  for (const double rate : rates) fmt::print(" {} Hz |", rate);
  fmt::print("\n|---|");
  for (std::size_t i = 0; i < rates.size(); ++i) fmt::print("---|");
  for (const T& value : values_of(cells, member)) {
    fmt::print("\n| {} |", value);
    for (const double rate : rates) {
      std::vector<Result> here;
      std::ranges::copy_if(cells, std::back_inserter(here), [&](const Result& result) {
        return result.cell.*member == value && result.cell.rate_hz == rate;
      });
      fmt::print(" {} |", show(here));
    }
  }
  fmt::print("\n\n");
}

void print_tables(const Results& results) {
  fmt::print("Bias along the way [σ]: mean of the cells (the largest).\n\n");
  print_by_rate(results.cells, &Cell::chassis, "chassis", bias_of);
  fmt::print("NEES, honest at 3: mean of the cells (the lowest to the highest).\n\n");
  print_by_rate(results.cells, &Cell::chassis, "chassis", nees_of);
  print_by_rate(results.cells, &Cell::counts, "counts of a revolution", nees_of);
}

void print_outside(const Results& results) {
  const auto number = std::ranges::count_if(
      results.cells, [&](const Result& result) { return outside(result, results.limit); });
  fmt::print("{} of {} cells.\n\n", number, results.cells.size());
  if (number == 0) return;
  print_header();
  for (const Result& result : results.cells) {
    if (outside(result, results.limit)) print(result, results.limit);
  }
  fmt::print("\n");
}

}  // namespace

int main(int argc, char** argv) {
  const auto arguments = read(argc, argv);
  if (!arguments) {
    fmt::print("{}", kUsageText);
    return 2;
  }
  const bool whole = arguments->filter.empty();
  fmt::print("## Known bias of the gyro\n\n");
  const std::vector<Cell> cells = matrix(*arguments);
  const Results known = run(cells, arguments->seeds, arguments->cells || cells.size() < 50);
  fmt::print("\n");
  print_tables(known);
  Results learned;
  if (whole) {
    fmt::print("## Bias of the gyro learned at rest\n\n");
    learned = run(learning_matrix(), arguments->seeds, arguments->cells);
    print_tables(learned);
  }
  fmt::print("## Outside the limits\n\n");
  fmt::print("Known bias: ");
  print_outside(known);
  if (whole) {
    fmt::print("Bias learned: ");
    print_outside(learned);
  }
}
