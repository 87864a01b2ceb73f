// The state of `trundle slam` with a checksum that is right; its filter goes on, or the state is refused. The
// first byte of an input is the method.
#include <array>

#include "trundle/io/archive.hpp"
#include "trundle/slam/slam.hpp"

#include "input.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace trundle;
  using slam::SlamMethod;
  constexpr std::array kMethods = {SlamMethod::fastslam1, SlamMethod::fastslam2, SlamMethod::mapso,
                                   SlamMethod::mapso_proposal, SlamMethod::ekf};
  if (size == 0) return 0;
  return fuzz::try_to([&] {
    slam::SlamRun run({}, {.method = kMethods[data[0] % kMethods.size()], .particles = 4});
    try {
      io::resume_state(run, fuzz::text_of(data + 1, size - 1));
    } catch (const io::DamagedState&) {
      return;
    }
    for (int i = 0; i < 3; ++i)
      run.step({.time_s = 1e3 + i,
                .motion = {.mean = {0.1, 0.0, 0.01}, .covariance = 1e-4 * geometry::Matrix3::Identity()},
                .observations = {{.landmark = 1, .range_m = 2.0, .bearing_rad = 0.1},
                                 {.range_m = 3.0, .bearing_rad = 1.0}}});
    (void)run.result();
  });
}
