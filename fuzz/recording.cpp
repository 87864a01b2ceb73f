// The native files of a recording, and what they may be called.
#include "folder_of_recording.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return trundle::fuzz::read_folder(trundle::fuzz::text_of(data, size));
}
