// Lines of `trundle live`. Each answer is JSON: no NaN, no infinity.
#include <nlohmann/json.hpp>

#include "trundle/pipeline/live.hpp"

#include "input.hpp"
#include "live_robot.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace trundle;
  static const chassis::Robot robot = fuzz::live_robot(true);
  pipeline::LiveOdometer odometer(robot, {});
  std::vector<pipeline::LiveEstimate> estimates;
  std::string_view lines = fuzz::text_of(data, size);
  while (!lines.empty()) {
    const std::size_t end = std::min(lines.find('\n'), lines.size());
    fuzz::try_to(
        [&] { odometer.take(pipeline::parse_live_line(lines.substr(0, end), "stdin"), "stdin", estimates); });
    lines.remove_prefix(std::min(end + 1, lines.size()));
  }
  fuzz::try_to([&] { odometer.finish(estimates); });
  for (const pipeline::LiveEstimate& estimate : estimates)
    fuzz::require(nlohmann::json::accept(pipeline::line_of(estimate, robot)));
  for (const pipeline::LiveSighted& sighted : odometer.take_sighted())
    fuzz::require(nlohmann::json::accept(pipeline::line_of(sighted)));
  fuzz::require(nlohmann::json::accept(pipeline::line_of(0.0, odometer.map())));
  return 0;
}
