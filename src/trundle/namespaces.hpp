/// The namespaces: one for each module, in the order of the layers. A module sees the names of those above
/// its own line as if they were its own; users write `trundle::odometry::Odometer`.
#pragma once

namespace trundle {

// clang-format off
namespace io {}
namespace statistics  { using namespace io; }
namespace simd        { using namespace statistics; }
namespace geometry    { using namespace simd; }
namespace chassis     { using namespace geometry; }
namespace logs        { using namespace chassis; }
namespace recording   { using namespace logs; }
namespace simulation  { using namespace recording; }
namespace odometry    { using namespace simulation; }
namespace slip        { using namespace odometry; }
namespace evaluation  { using namespace slip; }
namespace calibration { using namespace evaluation; }
namespace inspection  { using namespace calibration; }
namespace slam        { using namespace inspection; }
namespace report      { using namespace slam; }
namespace pipeline    { using namespace report; }
// clang-format on

}  // namespace trundle
