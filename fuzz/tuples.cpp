// A .tuple log: JSON objects one after another.
#include "trundle/recording/recording.hpp"

#include "input.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace trundle;
  static const fuzz::Folder folder;
  folder.write("log.tuple", fuzz::text_of(data, size));
  return fuzz::try_to([&] { recording::read_recording(folder.path() / "log.tuple"); });
}
