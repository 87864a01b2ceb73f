// The state of `trundle slam` with a checksum that is right: it is read, or refused. The first byte of an
// input is the method. Whether what was read belongs together is not checked: the filter does not go on here.
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
    (void)io::state_of(run);
  });
}
