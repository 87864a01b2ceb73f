#include "trundle/logs/detail/temporary_folder.hpp"

#include <cstdlib>
#include <string>
#include <system_error>

#include "trundle/io/error.hpp"

namespace trundle::logs {

TemporaryFolder::TemporaryFolder() {
  std::error_code error;
  const std::filesystem::path parent = std::filesystem::temp_directory_path(error);
  std::string name = (parent / "trundle_log_XXXXXX").string();
  if (error || ::mkdtemp(name.data()) == nullptr)
    throw InputError(parent.string(), "takes no temporary folder",
                     "room for a log that is decompressed or recovered");
  path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code error;
  std::filesystem::remove_all(path_, error);
}

}  // namespace trundle::logs
