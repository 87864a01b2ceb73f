#pragma once

#include <algorithm>

#include <gmock/gmock.h>

namespace trundle::test {

/// One line, and only one: "trundle: ...\n".
MATCHER(IsOneLineOfError, "is one line that starts with 'trundle: '") {
  return arg.starts_with("trundle: ") && arg.ends_with('\n') && std::ranges::count(arg, '\n') == 1;
}

}  // namespace trundle::test
