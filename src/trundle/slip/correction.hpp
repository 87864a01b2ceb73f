#pragma once

#include <span>

#include "trundle/slip/evidence.hpp"
#include "trundle/slip/parity.hpp"

namespace trundle::slip {

/// How the readings of an interval are to be corrected. docs/theory/slip-correction.md, eq. 11;
/// docs/theory/slip-published.md, eq. 5.
struct SlipCorrection {
  PerWheel variance{};      ///< added to the wheels' readings [m²]
  int rebuilt_wheel = -1;   ///< `published`: this wheel's travel is computed from ...
  int other_wheel = -1;     ///< ... the other wheel and the gyro
  double track_m = 0.0;     ///< signed: rebuilt − other = track · tan g
  double bias_rad_s = 0.0;  ///< of the gyro

  bool none() const { return *this == SlipCorrection{}; }
  bool operator==(const SlipCorrection&) const = default;

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.variance, self.rebuilt_wheel, self.other_wheel, self.track_m, self.bias_rad_s);
  }
};

/// Increments of a recording that are corrected alike, by their numbers in it: from `begin` on, before `end`.
struct CorrectedSpan {
  std::size_t begin = 0;
  std::size_t end = 0;
  SlipCorrection correction;
};

/// The corrected readings: never fewer than were measured.
Increment corrected(const Increment& increment, const SlipCorrection& correction, const Chassis& chassis);

/// Corrects a recording's increments one after the other. Spans, in order, and chassis must outlive it.
class IncrementCorrector {
 public:
  IncrementCorrector(std::span<const CorrectedSpan> spans, const Chassis& chassis)
      : spans_(spans), chassis_(&chassis) {}

  [[nodiscard]] Increment next(const Increment& increment) {
    const std::size_t i = next_++;
    while (!spans_.empty() && spans_.front().end <= i) spans_ = spans_.subspan(1);
    if (spans_.empty() || i < spans_.front().begin) return increment;
    return corrected(increment, spans_.front().correction, *chassis_);
  }

 private:
  std::span<const CorrectedSpan> spans_;
  const Chassis* chassis_;
  std::size_t next_ = 0;
};

/// Variances of which the estimate becomes the mean of the alternatives, weighted with their probabilities,
/// and its covariance theirs: docs/theory/slip-correction.md, eq. 11. `slipping`: else the slip may have
/// ended before this interval.
SlipCorrection mixture_of(const SlipEvidence& slip, const Contradiction& c, bool slipping);

/// Source 2's: the travel of `wheel` from the other wheel and the gyro. docs/theory/slip-published.md, eq. 5.
SlipCorrection rebuilt(int wheel, const Contradiction& c, const Rows& rows, const GyroBias& bias);

}  // namespace trundle::slip
