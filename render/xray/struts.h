#pragma once
/// The metal of a stent, as a line that can be cast like a wire of its struts' thickness.

#include <span>

#include "physics/geometry/vec.h"

namespace render {

/// One wire all the way: a wave wound around `axis` [mm], on the surface whose radius is that of `radii` at
/// each of its points and linear in between [mm]. A turn takes `pitch` of the axis [mm], and its wave, crowns
/// + ½ to a turn, has an amplitude of half of that, so that each crown touches one of the turn beyond.
/// Towards the ends of the axis, which the metal does not leave, the amplitude falls to nothing.
///
/// The wave's length to a turn is ∫ √((r dφ)² + dz²), and what struts of width w cover of a vessel's wall,
/// the metal-to-artery ratio, is that times w/(2πr pitch). It is 19 % for a coronary stent of 3 mm (9 crowns,
/// a pitch of 1 mm, 0.08 mm), 16 % for a renal one of 6 mm (8 crowns, 2 mm, 0.15 mm) and 17 % for an iliac
/// one of 8 mm (8 crowns, 2 mm, 0.2 mm), of which makers state 10 to 20 %.
///
/// Frames are carried along the axis without a twist, so that bends do not wind the wave up. Points of the
/// axis that lie on those before them do not count; no line for fewer than two others, a number of radii
/// other than that of points, values that are not finite, no crowns, or a pitch that is not positive.
geometry::Polyline struts(std::span<const geometry::Vec3> axis, std::span<const double> radii, int crowns,
                          double pitch);

}  // namespace render
