#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include "trundle/recording/alignment/gyro_integral.hpp"
#include "trundle/recording/recording.hpp"

namespace trundle::recording {

/// Samples of a gyro, and which steps between them lost its rate: no offset of its clock changes that. The
/// stream, which must hold a sample, must outlive it.
struct GyroSamples {
  GyroSamples(const GyroStream& gyro, const Gyro& sensor);

  const GyroStream& stream;
  std::vector<bool> is_lost;  ///< the step that ends at each sample
  double before_s = 0.0;      ///< it reaches so far before its first sample: a step, not a gap
  double beyond_s = 0.0;      ///< and beyond its last
};

/// What a gyro turned from time to time: a GyroIntegral of which all samples are there, so that each is
/// passed once and nothing is kept.
class GyroTurns {
 public:
  /// `offset_s`: added to its stamps.
  GyroTurns(const GyroSamples& samples, double offset_s, double start_s)
      : samples_(samples), offset_s_(offset_s) {
    after_.time_s = samples.stream.time_s.front() + offset_s;
    start_ = at(start_s);
  }

  /// From the time before to this later one [rad]; nothing where it has a gap or was saturated.
  [[nodiscard]] std::optional<double> until(double time_s) {
    const Reading start = start_;
    start_ = at(time_s);
    if (!start.known || !start_.known || start_.lost_after != start.lost_before) return std::nullopt;
    return start_.angle - start.angle;
  }

 private:
  using Reading = GyroIntegral::Reading;
  struct Sample {
    double time_s = 0.0;
    double angle = 0.0;
    std::size_t lost = 0;  ///< steps without a usable rate up to here
  };

  Reading at(double time_s) {
    while (after_.time_s < time_s) advance();
    if (next_ == 0 || next_ == samples_.is_lost.size())
      return beyond(samples_, next_ == 0, next_ == 0 ? after_ : before_, time_s);
    const double ahead_s = after_.time_s - time_s;
    if (ahead_s == 0.0) return {true, after_.angle, after_.lost, after_.lost};
    const double u = 1.0 - ahead_s / (after_.time_s - before_.time_s);
    return {true, before_.angle + u * (after_.angle - before_.angle), before_.lost, after_.lost};
  }

  void advance() {
    before_ = after_;
    if (++next_ == samples_.is_lost.size()) {
      after_.time_s = std::numeric_limits<double>::infinity();
      return;
    }
    after_.time_s = samples_.stream.time_s[next_] + offset_s_;
    if (samples_.is_lost[next_])
      ++after_.lost;
    else
      after_.angle += samples_.stream.yaw_rate_rad_s[next_] * (after_.time_s - before_.time_s);
  }

  /// Up to the first sample, or after the last: there a rate holds for a step. Of values: members stay in
  /// registers.
  static Reading beyond(const GyroSamples& samples, bool before_first, Sample nearest, double time_s);

  const GyroSamples& samples_;
  double offset_s_;
  std::size_t next_ = 0;   ///< which sample after_ is; beyond the last there is none
  Sample before_, after_;  ///< the last sample before the time, and the first one at it or after it
  Reading start_;
};

}  // namespace trundle::recording
