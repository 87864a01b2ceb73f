// Runs a target through the files of a folder, where there is no libFuzzer.
#include <cstdio>
#include <exception>
#include <filesystem>

#include "trundle/io/file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

int main(int argc, char** argv) {
  std::size_t count = 0;
  try {
    for (const auto& entry : std::filesystem::directory_iterator(argc > 1 ? argv[1] : ".")) {
      std::printf("%s\n", entry.path().c_str());
      std::fflush(stdout);  // the last one is at fault if it crashes
      const std::string content = trundle::io::read_file(entry.path());
      LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(content.data()), content.size());
      ++count;
    }
  } catch (const std::exception& error) {
    std::printf("%s\n", error.what());
    return 1;
  }
  std::printf("%zu inputs\n", count);
  return count > 0 ? 0 : 1;
}
