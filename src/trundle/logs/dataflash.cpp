#include "trundle/io/error.hpp"
#include "trundle/logs/detail/formats.hpp"

namespace trundle::logs {

std::unique_ptr<Log> open_dataflash(const std::filesystem::path& path, const Limits&) {
  throw InputError(path.string(), "is ArduPilot DataFlash, which is not read yet", "another log");
}

}  // namespace trundle::logs
