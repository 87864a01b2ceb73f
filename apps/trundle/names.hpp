/// The program's namespace sees every module's names as its own.
#pragma once

#include "trundle/namespaces.hpp"

namespace trundle::app {
using namespace pipeline;
}  // namespace trundle::app
