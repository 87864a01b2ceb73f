// recording.toml, and foreign CSV files that it maps.
#include "folder_of_recording.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return trundle::fuzz::read_folder(trundle::fuzz::text_of(data, size));
}
