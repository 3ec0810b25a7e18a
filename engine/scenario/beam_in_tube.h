#pragma once
/// A beam that lies in a bent tube, both elastic, the tube on a foundation: small displacements.

#include <vector>

#include "physics/geometry/vec.h"

namespace scenario {

/// At equal distances along the tube's axis.
struct TubeNode {
    geometry::Vec3 centre = geometry::Vec3::Zero();  // [mm]
    double clearance = 0;                            // of the beam's axis from the tube's, free [mm]
    double rigidity = 0;                             // EI of the beam; 0 = it does not reach here [N·mm²]
    geometry::Vec3 rest = geometry::Vec3::Zero();    // its curvature without load [1/mm]
    double modulus = 0, bending = 0;  // k_f of the foundation and B of the tube [N/mm²], [N·mm²]
};

/// How far the beam pushes the tube aside, at each node, across the tube [mm]. Beam and tube bear
///     U = ½∫ EI |x″ − κ⁰|² + k_f |d|² + B |d″|² + 20 k_f (|x − c − d| − clearance)₊² ds,
/// x and d across the axis c: convex, so that there is one answer, of whatever course. The beam is free at
/// its ends, or `clamped` along the axis where the tube begins. `step`: between nodes [mm]. At least four
/// nodes, the first ones with a beam; moduli > 0.
std::vector<double> pushed_aside(const std::vector<TubeNode>&, double step, bool clamped);

}  // namespace scenario
