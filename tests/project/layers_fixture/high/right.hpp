#include "trundle/low/wrong.hpp"
namespace trundle::low {}
