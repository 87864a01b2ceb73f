#include "trundle/inspection/counts_read_otherwise.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include "trundle/chassis/rows.hpp"
#include "trundle/inspection/reference_turns.hpp"
#include "trundle/io/error.hpp"
#include "trundle/recording/csv/detail/streams.hpp"
#include "trundle/recording/turns.hpp"

namespace trundle::inspection {
namespace {

constexpr double kAgreeRead = 0.9;     // correlation: 81 % of the variance
constexpr double kDisagreeRead = 0.3;  // 9 %

double agreement(const PairedSums& pairs) {
  return pairs.xx > 0.0 ? std::abs(pairs.correlation()) : 0.0;
}

std::vector<double> sums_of(const std::vector<double>& cells) {
  std::vector<double> sums(cells.size());
  double sum = 0.0;  // an empty cell is no count
  std::ranges::transform(cells, sums.begin(),
                         [&](double cell) { return std::isnan(cell) ? cell : sum += cell; });
  return sums;
}

std::vector<double> differences_of(const std::vector<double>& sums) {
  std::vector<double> cells(sums.size());
  std::adjacent_difference(sums.begin(), sums.end(), cells.begin());
  if (!cells.empty()) cells.front() = 0.0;
  return cells;
}

using Reread = std::vector<double> (*)(const std::vector<double>&);

/// How well the wheels agree with what else sees the robot turn, if their columns are read so.
double agreement_read(Reread otherwise, const Recording& recording, const Robot& robot) {
  Recording reread = recording;
  for (WheelSeries& series : reread.wheels.series)
    if (series.unit != WheelUnit::rate) series.value = otherwise(series.value);
  try {
    const auto pairs = turns_beside(reread, robot, overview_of(reread, robot).turns);
    return pairs ? agreement(*pairs) : 0.0;
  } catch (const InputError&) {
    return 0.0;
  }
}

Finding finding_of(FindingCode code, Reread cells_of, const Recording& recording) {
  Finding finding{.code = code, .place = recording.wheels.origin.file};
  payload::Range range{INFINITY, -INFINITY};
  for (const WheelSeries& series : recording.wheels.series) {
    finding.subjects.push_back(column_name(series));
    for (const double value : cells_of == nullptr ? series.value : cells_of(series.value)) {
      range.low = std::fmin(range.low, value);
      range.high = std::fmax(range.high, value);
    }
  }
  finding.payload = range;
  return finding;
}

}  // namespace

std::optional<Finding> counts_read_otherwise(const Recording& recording, const Robot& robot,
                                             const Overview& overview) {
  const auto& series = recording.wheels.series;
  const auto goes_on = [](const WheelSeries& one) { return one.unit != WheelUnit::rate; };
  if (std::ranges::none_of(series, goes_on) || observability(rows_of(robot.chassis, false)).rank < 3)
    return std::nullopt;
  const auto pairs = turns_beside(recording, robot, overview.turns);
  if (!pairs || agreement(*pairs) > kDisagreeRead) return std::nullopt;
  if (agreement_read(sums_of, recording, robot) > kAgreeRead)
    return finding_of(FindingCode::increments, nullptr, recording);
  if (agreement_read(differences_of, recording, robot) > kAgreeRead)
    return finding_of(FindingCode::not_increments, differences_of, recording);
  return std::nullopt;
}

}  // namespace trundle::inspection
