#include "trundle/low/wrong.hpp"
