#pragma once

#include <cstdlib>
#include <filesystem>

namespace trundle::test {

/// Where the real recordings are: $TRUNDLE_DATA, else ../shared/data beside the checkout. May not exist.
inline std::filesystem::path real_data() {
  if (const char* folder = std::getenv("TRUNDLE_DATA")) return folder;
  return std::filesystem::path(TRUNDLE_SOURCE_DIR) / "../shared/data";
}

}  // namespace trundle::test

/// Skips the test, and says so, where the recordings are missing.
#define TRUNDLE_NEEDS_REAL_DATA(folder)                                \
  if (!std::filesystem::exists(trundle::test::real_data() / (folder))) \
  GTEST_SKIP() << "real data not found: " << trundle::test::real_data() / (folder)
