#include "trundle/io/error.hpp"
#include "trundle/logs/detail/formats.hpp"

namespace trundle::logs {

std::unique_ptr<Log> open_wpilog(const std::filesystem::path& path, const Limits&) {
  throw InputError(path.string(), "is WPILOG, which is not read yet", "another log");
}

}  // namespace trundle::logs
