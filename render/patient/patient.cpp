#include "render/patient/patient.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "render/patient/patient_parts.h"

namespace render {

using geometry::Polyline;
using geometry::TriangleMesh;
using geometry::Vec3;

namespace {

constexpr double skin_behind = 108.0;   // of the back, behind the front of the lumbar vertebrae [mm]
constexpr double head_top = 733.0;      // z of the vertex [mm]
constexpr double chest_middle = 300.0;  // z at which the depth of the chest is given [mm]

/// A region of the body and the heights that its organs fill [mm].
struct Region {
    double low, high;
    bool reached_by(double from, double to) const { return low < to && high > from; }
};
constexpr Region abdomen{-460.0, 190.0}, chest{150.0, 470.0}, head{455.0, head_top};

/// Cross-sections of the skin from the thighs to the vertex, middle relative to the front of L4, and the fat
/// under it. Those below `scaled_below` follow the width and depth of the patient.
struct SkinSection {
    double z, half_width, half_depth, middle, exponent, fat;  // [mm], exponent [-]
};
constexpr double scaled_below = 190.0;
constexpr SkinSection skin[] = {
    {-460, 187.5, 112.5, -4.5, 2.4, 15},
    {-60, 187.5, 112.5, -4.5, 2.4, 15},
    {-20, 182, 111, -4.5, 2.4, 15},
    {25, 176.3, 109, -4.5, 2.4, 15},
    {70, 181, 111, -4.5, 2.4, 15},
    {130, 183, 112, -3.5, 2.4, 15},
    {190, 180, 118, 0, 2.4, 14},
    {260, 178, 129, -2, 2.4, 13},
    {320, 182, 128, 3, 2.4, 13},
    {355, 196, 124, 13, 2.4, 12},
    {385, 224, 110, 12, 2.5, 12},
    {412, 228, 98, 13, 2.5, 10},
    {434, 215, 88, 14, 2.4, 9},
    {450, 140, 68, 18, 2.2, 7},
    {462, 88, 61, 15, 2, 6},
    {476, 68, 58, 9, 2, 5},
    {500, 61, 58, 3, 2, 4},
    {512, 63, 74, -14, 2, 4},
    {524, 68, 90, -29, 2.1, 4},
    {552, 70, 94, -31, 2.1, 4},
    {580, 78, 100, -20, 2.1, 4},
    {605, 80, 103, -11, 2.2, 4},
    {630, 83, 104, -3, 2.3, 4},
    {660, 84, 104, 3, 2.3, 4},
    {690, 78, 97, 6, 2.2, 4},
    {712, 62, 80, 8, 2.1, 4},
    {726, 40, 55, 8, 2, 4},
    {head_top, 14, 20, 8, 2, 4},
};

/// Catmull-Rom between rows, so that no creases show.
SkinSection skin_at(double z) {
    constexpr int rows = std::size(skin);
    int i = 0;
    while (i + 2 < rows && z > skin[i + 1].z) ++i;
    const SkinSection &before = skin[std::max(i - 1, 0)], &low = skin[i], &high = skin[i + 1],
                      &after = skin[std::min(i + 2, rows - 1)];
    const double span = high.z - low.z, t = std::clamp((z - low.z) / span, 0.0, 1.0);
    const auto smooth = [&](double SkinSection::*value) {
        const double from = low.*value, to = high.*value;
        const double slope_from = i == 0 ? 0.0 : (to - before.*value) / (high.z - before.z) * span;
        const double slope_to = i + 2 >= rows ? 0.0 : (after.*value - from) / (after.z - low.z) * span;
        return (1 + 2 * t) * (1 - t) * (1 - t) * from + t * (1 - t) * (1 - t) * slope_from +
               t * t * (3 - 2 * t) * to - t * t * (1 - t) * slope_to;
    };
    return {z,
            smooth(&SkinSection::half_width),
            smooth(&SkinSection::half_depth),
            smooth(&SkinSection::middle),
            smooth(&SkinSection::exponent),
            smooth(&SkinSection::fat)};
}

/// The body's surface from one height to another, or the surface under its fat.
TriangleMesh trunk(const PatientSpec& spec, double chest_front, double low, double high, bool under_fat) {
    const int steps = std::max(8, static_cast<int>((high - low) / 11.0));
    std::vector<Ring> rings;
    for (int i = 0; i <= steps; ++i) {
        SkinSection at = skin_at(low + (high - low) * i / steps);
        // From the abdomen as requested to the chest as it must be.
        const double up = std::clamp((at.z - 110.0) / (scaled_below - 110.0), 0.0, 1.0);
        const double neck = std::clamp((at.z - 400.0) / 60.0, 0.0, 1.0);
        const double wider = spec.width / 375.0, back = at.middle + at.half_depth;
        at.half_width *= wider + up * (1.0 - wider);
        const double deeper =
            (1.0 - up) * (spec.depth - 225.0) +
            up * (1.0 - neck) *
                (skin_at(chest_middle).middle - skin_at(chest_middle).half_depth - chest_front);
        at.half_depth += 0.5 * deeper;
        const double less = under_fat ? at.fat : 0.0;
        Ring ring;
        ring.centre = Vec3(0.0, back - at.half_depth, at.z);
        if (under_fat && i == 0) ring.centre.z() += less;
        if (under_fat && i == steps) ring.centre.z() -= std::min(less, 4.0);
        ring.a = at.half_width - less;
        ring.b = at.half_depth - less;
        ring.exponent = at.exponent;
        rings.push_back(ring);
    }
    return loft(rings, 48);
}

}  // namespace

void add_tube(Bones& bones, const Polyline& path, const Vec3& u, const std::vector<double>& a,
              const std::vector<double>& b, double wall, int around) {
    append(bones.outer, tube(path, u, a, b, around));
    std::vector<double> inner_a, inner_b;
    for (double x : a) inner_a.push_back(std::max(x - wall, 0.25 * x));
    for (double x : b) inner_b.push_back(std::max(x - wall, 0.25 * x));
    // The core ends short of the lids.
    Polyline inner = path;
    inner.front() += std::min(wall / (path[1] - path[0]).norm(), 0.4) * (path[1] - path[0]);
    inner.back() += std::min(wall / (path[path.size() - 2] - path.back()).norm(), 0.4) *
                    (path[path.size() - 2] - path.back());
    append(bones.core, tube(inner, u, inner_a, inner_b, around));
}

void add_ellipsoid(Bones& bones, const Vec3& centre, const Vec3& half_axes, double wall, int around) {
    append(bones.outer, ellipsoid(centre, half_axes, around));
    append(bones.core, ellipsoid(centre, half_axes - Vec3::Constant(wall), around));
}

PatientSpec patient_around(std::span<const Vec3> wall, const geometry::BodyPlace& place) {
    PatientSpec spec;
    spec.origin = place.at - place_in_body(place.landmark);
    if (wall.empty()) return spec;
    spec.lower = spec.upper = wall.front();
    for (const Vec3& p : wall) {
        spec.lower = spec.lower.cwiseMin(p);
        spec.upper = spec.upper.cwiseMax(p);
    }
    // The column stands behind what lies in front of it from L4 to the upper chest: the aorta.
    constexpr double before = 15.0, gap = 3.0, top = 390.0;
    for (const Vec3& p : wall) {
        const double z = p.z() - spec.origin.z();
        if (z < 0.0 || z > top || std::abs(p.x() - spec.origin.x()) > before) continue;
        spec.origin.y() = std::max(spec.origin.y(), p.y() - spine_front(z) + gap);
    }
    const double margin = 25.0;
    const double widest =
        std::max(spec.upper.x() - spec.origin.x(), spec.origin.x() - spec.lower.x()) + margin;
    spec.width = std::max(spec.width, 2.0 * widest);
    spec.depth = std::max(spec.depth, spec.origin.y() + skin_behind - spec.lower.y() + margin);
    return spec;
}

std::vector<TissueLayer> make_patient(const PatientSpec& spec) {
    constexpr double margin = 120.0;  // how far beyond the vessels the C-arm may look [mm]
    const double from = spec.lower.z() - spec.origin.z() - margin,
                 to = spec.upper.z() - spec.origin.z() + margin;
    const bool with_abdomen = abdomen.reached_by(from, to), with_chest = chest.reached_by(from, to),
               with_head = head.reached_by(from, to);
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const auto& [region, there] :
         {std::pair{abdomen, with_abdomen}, {chest, with_chest}, {head, with_head}}) {
        if (!there) continue;
        low = std::min(low, region.low);
        high = std::max(high, region.high);
    }

    // Oblique rays should leave through flesh, not through the cut.
    low -= margin;
    high = std::min(high + margin, head_top);

    std::vector<VesselSample> vessels;
    double front = skin_at(chest_middle).middle - skin_at(chest_middle).half_depth;
    for (const VesselSample& sample : spec.vessels) {
        const Vec3 place = sample.place - spec.origin;
        vessels.push_back({place, sample.radius});
        // Sternum and chest wall lie in front of the foremost vessel.
        if (place.z() > chest.low && place.z() < 380.0)
            front = std::min(front, place.y() - sample.radius - 34.0);
    }
    const Chest thorax{front, vessels};

    Bones bones;
    add_spine(bones, low + 20.0, high - 20.0);
    if (with_abdomen) add_pelvis(bones);
    if (with_chest) add_cage(bones, thorax);
    if (with_head) add_head_bones(bones);

    std::vector<TissueLayer> layers;
    layers.push_back(
        {"skin and fat", Material::Adipose, Material::Air, trunk(spec, front, low, high, false), false});
    layers.push_back(
        {"trunk", Material::SoftTissue, Material::Adipose, trunk(spec, front, low, high, true), false});
    layers.push_back({"bones", Material::CorticalBone, Material::SoftTissue, std::move(bones.outer), false});
    layers.push_back(
        {"marrow", Material::TrabecularBone, Material::CorticalBone, std::move(bones.core), false});
    if (with_abdomen) add_abdomen_layers(layers, skin_behind - spec.depth, spec.bowel_gas);
    if (with_chest) add_chest_layers(layers, thorax);
    if (with_head) add_head_layers(layers);
    for (TissueLayer& layer : layers) {
        for (Vec3& v : layer.mesh.vertices) v += spec.origin;
    }
    return layers;
}

}  // namespace render
