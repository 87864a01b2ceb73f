#pragma once

#include <filesystem>

#include "trundle/namespaces.hpp"

namespace trundle::logs {

/// A folder that ends with its holder.
class TemporaryFolder {
 public:
  /// Throws InputError where none can be made.
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace trundle::logs
