#pragma once
/// Signed distances to a lumen's wall as one sheet of the vessels sees it, and the grids made of them.

#include <functional>
#include <vector>

#include "physics/bspline_grid.h"
#include "physics/lumen_surface.h"
#include "physics/seen_surface.h"
#include "physics/vessel_sheets.h"

namespace physics {

struct FieldBand {
    double spacing, inner, outer;  // [mm]
    double wide;                   // vessels of this radius or more are known at twice the spacing [mm]
    int threads;
    std::size_t largest;  // [bytes]
};

/// The surface of a lumen with these centrelines, facing out of them.
LumenSurface lumen_surface(const TriangleMesh&, const CentrelineTree&);

/// The field of a sheet: `fine` where that is known, else `coarse`, of twice its spacing; one function, twice
/// continuously differentiable.
struct SheetField {
    SplineGrid coarse, fine;

    bool evaluate(const Vec3& x, SplineValue& out) const {
        return fine.evaluate(x, out) || coarse.evaluate(x, out);
    }
    std::size_t bytes() const { return coarse.bytes() + fine.bytes(); }
};

/// Per sheet the signed distance, negative inside: coarse where the nearest wall is a wide vessel's and has
/// no crease. Throws std::invalid_argument when they would be larger than the band allows.
std::vector<SheetField> sampled_fields(const LumenSurface&, const CentrelineTree&, const VesselSheets&,
                                       const FieldBand&, const std::function<void(double)>& progress);

}  // namespace physics
