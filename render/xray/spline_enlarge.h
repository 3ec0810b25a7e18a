#pragma once
/// Fields at more pixels, by cubic B-splines.

#include "render/picture/image.h"

namespace render {

/// The square field without `margin` pixels on each side, at `pixels` along a side: the cubic B-spline
/// through the given values at the new pixels' centres. Exact for cubic polynomials away from the outer edge.
Field spline_enlarged(Field, int margin, int pixels);

}  // namespace render
