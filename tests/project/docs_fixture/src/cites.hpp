#pragma once

/// docs/theory/page.md, eq. 1, is there; docs/theory/page.md, eq. 2, and
/// docs/gone.md are not.
