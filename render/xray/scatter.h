#pragma once
/// Scattered radiation behind the patient and the grid.

#include "render/picture/image.h"
#include "render/xray/materials.h"

namespace render {

/// How scatter is spread along one side of the detector: two Gaussians, of what passes between the grid's
/// strips or is scattered little, and of the rest.
struct ScatterWidth {
    double narrow_fraction = 1.0;     // of the first [-]
    double narrow = 1.0, wide = 1.0;  // standard deviations on the detector [mm]
};

/// What a thin ray scatters onto the detector behind a grid of ratio 13 with 70 strips of 0.036 mm lead per
/// cm. Strips run from head to foot.
struct ScatterSpread {
    double per_primary = 0.0;  // all of it over the primary of the same ray, both behind the grid [-]
    ScatterWidth across, along;
};

/// `thickness`: of soft tissue [mm]; `gap`: from where the ray leaves it to the detector [mm]; tube voltage
/// [kV]. Fitted to photons followed through slabs of 20 to 400 mm and air gaps of 50 to 400 mm at 70, 90 and
/// 110 kV by the cross-section of Klein and Nishina (Z. Phys. 52 (1929) 853) with the tables of
/// materials.cpp; the test of this file follows them again. Coherent scatter is left out. Without a grid the
/// same photons give 2.5 times the primary behind 200 mm, 4.1 behind 300 mm, for a field of 300 × 300 mm at
/// 90 kV.
ScatterSpread scatter_spread(double thickness, double gap, double kvp);

/// Scatter on each place of an image, in the unit of `primary`, its primary where the collimator is open.
/// `thickness`: of each ray [mm of soft tissue]; `pixel`: width on the detector [mm]; `behind`: from the
/// isocentre to the detector [mm]; the patient is taken to stand with his middle there. Scatter depends on
/// the thickness of each ray and, since it is spread beyond the field's edge, on the field.
Field scatter_field(const Field& primary, const Field& thickness, double kvp, double pixel, double behind);

/// Scatter in a measured image, by what a real system knows: the image itself, which is taken for that of
/// soft tissue, the signal of the open beam at its exposure, and the model above (adaptive scatter kernel
/// superposition after Sun and Star-Lack, Phys. Med. Biol. 55 (2010) 6695). `signal`: measured; `lit`: open
/// part of the field [-]; `open`: signal of the open beam on each pixel; all in one unit and of one size.
Field estimated_scatter(const Field& signal, const Field& lit, const Field& open, double kvp, double pixel,
                        double behind);

}  // namespace render
