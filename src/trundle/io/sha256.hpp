#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "trundle/namespaces.hpp"

namespace trundle::io {

/// SHA-256 of what is added.
class Sha256 {
 public:
  Sha256();
  ~Sha256();
  Sha256(const Sha256&) = delete;
  Sha256& operator=(const Sha256&) = delete;

  void add(std::string_view bytes);
  /// Lower-case hexadecimal, once.
  std::string hex();

 private:
  struct Context;
  std::unique_ptr<Context> context_;
};

}  // namespace trundle::io
