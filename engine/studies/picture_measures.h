#pragma once
/// What X-ray pictures are compared by, the program's and others'.

#include <array>
#include <cstdint>
#include <vector>

#include "render/picture/image.h"

namespace studies {

/// Standard deviation of the noise after Immerkaer (Computer Vision and Image Understanding 64, 1996, 300),
/// in the picture's unit. It takes the finest structure for noise.
double noise_of(const render::Field&);

/// The value that this fraction of the pixels are below.
double percentile(const render::Field&, double fraction);

/// How much darker each pixel is than the brightest places around it that are `reach` wide: the closing by a
/// square of 2 reach + 1 pixels, minus the picture.
render::Field depth_of_dark(const render::Field&, int reach);

/// The picture without this fraction of its width along each edge, where shutters may be.
render::Field inner_part(const render::Field&, double margin);

inline constexpr std::array<double, 4> octaves = {0.8, 1.6, 3.2, 6.4};  // from each to twice that [mm]

/// Of the logarithm of a signal, or of grey levels.
struct Structure {
    /// Tenth, half and nine tenths of the widths of edges, 10 to 90 % of their height, on the twentieth of
    /// the pixels with the steepest slope, where that is greatest along itself [mm].
    std::array<double, 3> edges{};
    double strongest = 0;  // fraction of the finest octave's power that 2 % of its pixels hold
    double evenness = 0;  // of that octave's rms in windows of 16 mm: their median over their 90th percentile
    std::array<double, 4> power{};  // median of each octave's rms in windows of 16 mm
};
/// `pixel`: width of one [mm]. An octave is the difference of two Gaussians, the wider twice the other, whose
/// passband has its middle where the octave's is. Throws std::invalid_argument for a picture smaller than
/// two such windows.
Structure structure_of(const render::Field&, double pixel);

/// Vessels on a picture of an area.
struct Ridges {
    double length = 0,
           branches = 0;  // of lines; of their forks, of which a crossing makes up to three [mm/cm²], [1/cm²]
};
/// `dark`: larger where a vessel is, as the logarithm of what contrast takes of the signal; `pixel`: width of
/// one [mm]; `area`: not 0 where to measure. Lines of 0.3 and 0.5 mm (standard deviation) whose curvature
/// across is above half that of which 5 % of the area have more are thinned to one pixel; those shorter than
/// 2 mm do not count. Without an area: zeros.
Ridges ridges_of(const render::Field& dark, double pixel, const std::vector<std::uint8_t>& area);

}  // namespace studies
