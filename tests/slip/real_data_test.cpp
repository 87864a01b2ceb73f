// A Kobuki with tape on a wheel, so that it slips, and the same robot without; skipped where the data are
// missing.
#include "real_data.hpp"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include "trundle/slip/find_slip.hpp"

#include "kobuki.hpp"
#include "recording/folder.hpp"

namespace trundle {
namespace {

using test::kobuki;

constexpr double kProbability = 0.01;
constexpr double kHalf_s = 37.5;  // of the recording without slip

Recording recording_of(const std::string& name, const std::string& cut = "") {
  const test::Folder folder;
  folder.write("recording.toml", fmt::format(R"(
time_origin = "first"
[wheels]
file = "{0}/core.csv"
time_unit = "ns"
{1}
columns = {{ time_s = "stamp_ns", left_ticks = "left_ticks", right_ticks = "right_ticks" }}
[gyro]
file = "{0}/imu.csv"
time_unit = "ns"
columns = {{ time_s = "stamp_ns", yaw_rate_rad_s = "gz_rads" }}
)",
                                             (test::real_data() / "kobuki_slip" / name).string(), cut));
  return read_recording(folder.path());
}

SlipCounts counts_of(const Recording& recording, const SlipOptions& options) {
  const SlipReport report = find_slip(align(recording, kobuki()), {}, kobuki(), options);
  return report.counts;
}

// The unit of the test is an interval of 0.25 s or 0.5 s in which a wheel turns.
TEST(RealSlip, KobukiWithTapeOnAWheel) {
  TRUNDLE_NEEDS_REAL_DATA("kobuki_slip");
  for (const double interval_s : {0.25, 0.5}) {
    const Recording clean = recording_of("nonfaulty", fmt::format("end_s = {}", kHalf_s));
    const LearnedResiduals learned =
        learn_residuals(clean_intervals(align(clean, kobuki()), kobuki(), interval_s), kobuki(),
                        {.probability = kProbability});
    SlipOptions options;
    options.probability = kProbability;
    options.interval_s = interval_s;
    options.model = learned.model;
    const auto tell = [&](const char* name, const SlipCounts& counts) {
      fmt::print("  {:.2f} s, {:<24} {:5.2f} % of {} moving intervals\n", interval_s, name,
                 100.0 * counts.flagged_share(), counts.judged);
      return counts.flagged_share();
    };
    const double second =
        tell("nonfaulty, second half",
             counts_of(recording_of("nonfaulty", fmt::format("start_s = {}", kHalf_s)), options));
    const double left = tell("left_faulty", counts_of(recording_of("left_faulty"), options));
    tell("right_faulty", counts_of(recording_of("right_faulty"), options));
    EXPECT_LE(second, 0.02);
    EXPECT_GE(left, 0.10);
    EXPECT_GE(left / std::max(second, 0.005), 10.0);
  }
}

}  // namespace
}  // namespace trundle
