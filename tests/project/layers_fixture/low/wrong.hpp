// Wrong on purpose: a lower layer includes a higher one. The test of the layers must find it.
#include "trundle/high/right.hpp"
