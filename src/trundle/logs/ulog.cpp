#include "trundle/io/error.hpp"
#include "trundle/logs/detail/formats.hpp"

namespace trundle::logs {

std::unique_ptr<Log> open_ulog(const std::filesystem::path& path, const Limits&) {
  throw InputError(path.string(), "is PX4 ULog, which is not read yet", "another log");
}

}  // namespace trundle::logs
