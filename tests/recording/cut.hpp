#pragma once

#include <vector>

#include "trundle/recording/recording.hpp"

namespace trundle::test {
using namespace recording;

/// What a log shows from one time to another.
inline Recording cut(const Recording& log, double start_s, double end_s) {
  Recording piece = log;
  const auto is_outside = [&](double t) { return t < start_s || t > end_s; };
  const auto keep = [&](std::vector<double>& values, const std::vector<double>& time_s) {
    std::size_t i = 0;
    std::erase_if(values, [&](double) { return is_outside(time_s[i++]); });
  };
  for (WheelSeries& series : piece.wheels.series) keep(series.value, log.wheels.time_s);
  keep(piece.wheels.time_s, log.wheels.time_s);
  for (auto* column : {&piece.reference.x_m, &piece.reference.y_m, &piece.reference.heading_rad})
    keep(*column, log.reference.time_s);
  keep(piece.reference.time_s, log.reference.time_s);
  return piece;
}

}  // namespace trundle::test
