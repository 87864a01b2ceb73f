// scenario.toml, and the robot that it names.
#include "trundle/simulation/scenario_file.hpp"

#include "input.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace trundle;
  static const fuzz::Folder folder;
  folder.clear();
  folder.write_all(fuzz::text_of(data, size));
  return fuzz::try_to([&] { simulation::read_plan(folder.path() / "scenario.toml"); });
}
