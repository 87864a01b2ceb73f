#pragma once

#include "trundle/io/pieces.hpp"
#include "trundle/pipeline/viewers/shown.hpp"

namespace trundle::pipeline {

/// So many poses at most are drawn of a whole path at once: more than a screen has pixels across.
inline constexpr std::size_t kMostPathPoses = 8000;
/// And so many ellipses, so that single ones can be seen.
inline constexpr std::size_t kMostEllipses = 100;

/// A stamp of the recording on the clock of its log [ns]. Throws CannotAnswer where it is before 0.
[[nodiscard]] std::int64_t nanoseconds_of(double time_s, const Shown& shown);

void write_mcap(const Shown& shown, const TakeText& take);
void write_wpilog(const Shown& shown, const TakeText& take);

}  // namespace trundle::pipeline
