#pragma once

#include <gmock/gmock.h>

#include "trundle/recording/finding.hpp"

namespace trundle::test {
using namespace recording;

/// Of a Finding whose sentence holds the words.
inline auto says(const char* words) {
  return testing::ResultOf(describe, testing::HasSubstr(words));
}

inline auto finding(FindingCode code, const char* words) {
  return testing::AllOf(testing::Field(&Finding::code, code), says(words));
}

}  // namespace trundle::test
