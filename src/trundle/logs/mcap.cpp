#include "trundle/io/error.hpp"
#include "trundle/logs/detail/formats.hpp"

namespace trundle::logs {

std::unique_ptr<Log> open_mcap(const std::filesystem::path& path, const Limits&) {
  throw InputError(path.string(), "is MCAP, which is not read yet", "another log");
}

}  // namespace trundle::logs
