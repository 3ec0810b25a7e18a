#pragma once
/// Signed distances to a lumen's wall as one sheet of the vessels sees it, and the grids made from them.

#include <functional>
#include <vector>

#include "physics/geometry/bspline_grid.h"
#include "physics/geometry/lumen_surface.h"
#include "physics/geometry/seen_surface.h"
#include "physics/wall/vessel_sheets.h"

namespace physics {

/// Distances at nodes are multiples of this [mm], so that they pack well. As a value is off by half of it at
/// most, a coefficient is by (5/3)³ times as much, and so is the spline (1.1 µm); a component of its gradient
/// by twice that over the spacing.
constexpr double value_step = 1.0 / 2048;

struct FieldBand {
    double spacing, inner, outer;  // [mm]
    double wide;  // vessels of at least this radius have twice the spacing, of twice this radius four times
    int threads;
    std::size_t largest;       // [bytes]
    double step = value_step;  // 0: distances are not rounded, and cannot be packed
};

/// The surface of a lumen with these centrelines, facing out of them.
LumenSurface lumen_surface(const TriangleMesh&, const CentrelineTree&);

/// The field of a sheet in grids of one, two and four times the spacing; the finest known one counts at each
/// place. Together they are one function, twice continuously differentiable.
struct SheetField {
    static constexpr int level_count = 3;
    std::vector<SplineGrid> grids;  // level_count

    bool evaluate(const Vec3& x, SplineValue& out) const {
        for (const SplineGrid& grid : grids)
            if (grid.evaluate(x, out)) return true;
        return false;
    }
    std::size_t bytes() const {
        std::size_t sum = 0;
        for (const SplineGrid& grid : grids) sum += grid.bytes();
        return sum;
    }
};

/// Level of the grid that is fine enough for a vessel of this radius.
inline int level_of(double radius, double wide) {
    return radius < wide ? 0 : radius < 2 * wide ? 1 : 2;
}

/// Area of a vessel's cross-section that the band fills [mm²].
double band_section(double radius, double inner, double outer);

/// Throws std::invalid_argument for a field that would take so many bytes, more than `largest`.
[[noreturn]] void refuse_size(double spacing, double bytes, std::size_t largest);

/// Signed distance of each sheet, negative inside; coarser where the nearest wall is a wide vessel's and has
/// no crease. Throws std::invalid_argument when the grids would be larger than the band allows.
std::vector<SheetField> sampled_fields(const LumenSurface&, const CentrelineTree&, const VesselSheets&,
                                       const FieldBand&, const std::function<void(double)>& progress);
/// The same in two steps: the distances at nodes, and the splines through them.
std::vector<SheetField> sampled_values(const LumenSurface&, const CentrelineTree&, const VesselSheets&,
                                       const FieldBand&, const std::function<void(double)>& progress);
void fit(std::vector<SheetField>&, int threads);

}  // namespace physics
