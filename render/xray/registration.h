#pragma once
/// How far an image has moved against a mask.

#include "render/picture/image.h"

namespace render {

/// The shift that lays a mask on an image best, to the right and down [pixels].
struct Registration {
    double x = 0.0, y = 0.0;
    bool found = false;  // false where mask and image share no structure; the shift is then 0
};

/// Registers ln(mask) with ln(signal) where `where` is above ½; all three of one size. Searches up to `reach`
/// [pixels] either way in a pyramid, then refines by Gauss-Newton steps (Lucas and Kanade 1981) whose
/// residuals are weighted by Geman and McClure's function, so that vessels full of contrast, which the mask
/// does not have, and what moved otherwise than most of the image count little.
Registration registration(const Field& log_mask, const Field& log_signal, const Field& where, double reach);

}  // namespace render
