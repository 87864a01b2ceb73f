// The state of `trundle live` with a checksum that is right; its odometer goes on, or the state is refused.
#include "trundle/io/archive.hpp"
#include "trundle/pipeline/live.hpp"

#include "input.hpp"
#include "live_robot.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace trundle;
  static const chassis::Robot robot = fuzz::live_robot();
  return fuzz::try_to([&] {
    pipeline::LiveOdometer odometer(robot, {});
    try {
      io::resume_state(odometer, fuzz::text_of(data, size));
    } catch (const io::DamagedState&) {
      return;
    }
    std::vector<pipeline::LiveEstimate> estimates;
    for (int i = 1; i <= 20; ++i) {
      const double time_s = 1e3 + 0.1 * i;
      const double ticks = 10.0 * i;
      odometer.take({time_s, {{"a", ticks}, {"b", ticks}, {"c", ticks}, {"d", i < 10 ? ticks : 90.0}}, 0.0},
                    "stdin", estimates);
    }
    odometer.finish(estimates);
  });
}
