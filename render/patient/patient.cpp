#include "render/patient/patient.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "physics/geometry/random.h"
#include "render/patient/patient_parts.h"

namespace render {
namespace {

constexpr double skin_behind = 108.0;   // of the back, behind the front of the lumbar vertebrae [mm]
constexpr double head_top = 739.0;      // z of the vertex [mm]
constexpr double skin_cell = 9.0;       // of the grid [mm]
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
    {450, 140, 72, 22, 2.2, 7},
    {462, 88, 66, 20, 2, 6},
    {476, 68, 63, 14, 2, 5},
    {500, 61, 62, 7, 2, 4},
    {512, 63, 84, -16, 2, 4},
    {524, 68, 94, -25, 2.1, 4},
    {552, 70, 97, -28, 2.1, 4},
    {580, 78, 100, -20, 2.1, 4},
    {605, 80, 103, -11, 2.2, 4},
    {630, 83, 104, -3, 2.3, 4},
    {660, 84, 104, 3, 2.3, 4},
    {690, 80, 98, 6, 2.2, 4},
    {714, 67, 84, 8, 2.1, 6},
    {731, 45, 61, 9, 2, 7},
    {head_top, 14, 20, 8, 2, 6},
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

constexpr double perineum = -196.0;  // z where the thighs part [mm]

/// The body's section at a height, as large as this patient's.
SkinSection section_of(const PatientSpec& spec, double chest_front, double z) {
    SkinSection at = skin_at(z);
    // From the abdomen as requested to the chest as it must be.
    const double up = std::clamp((z - 110.0) / (scaled_below - 110.0), 0.0, 1.0);
    const double neck = std::clamp((z - 400.0) / 60.0, 0.0, 1.0);
    const double wider = spec.width / 375.0, back = at.middle + at.half_depth;
    at.half_width *= wider + up * (1.0 - wider);
    const double deeper =
        (1.0 - up) * (spec.depth - 225.0) +
        up * (1.0 - neck) * (skin_at(chest_middle).middle - skin_at(chest_middle).half_depth - chest_front);
    at.half_depth += 0.5 * deeper;
    at.middle = back - at.half_depth;
    return at;
}

/// The body from one height to another.
struct Outline {
    const PatientSpec& spec;
    const Chest& chest;
    double low, high;
};

/// The body's surface; under its fat if `fraction` of the fat is 1; deeper by `inset` mm. Thighs 175 mm thick
/// below the perineum.
shape::Solid trunk(const Outline& outline, double fraction, double inset) {
    const PatientSpec spec = outline.spec;
    const double low = outline.low, high = outline.high, chest_front = outline.chest.front;
    shape::Compound body;
    const double widest = std::max(240.0, 0.7 * spec.width), deepest = 200.0 + spec.depth;
    body.add({[=](const Vec3& p) {
                  const double z = std::clamp(p.z(), low, high);
                  // Where the head closes, fat lies above more than beside.
                  const double closing = std::clamp((z - 670.0) / 40.0, 0.0, 1.0);
                  const SkinSection at =
                      section_of(spec, chest_front, std::min(z + 5.0 * fraction * closing, high));
                  const double less = fraction * at.fat + inset;
                  const double a = at.half_width - less, b = at.half_depth - less, n = at.exponent;
                  const double qx = std::max(std::abs(p.x()) / a, 1e-6),
                               qy = std::max(std::abs(p.y() - at.middle) / b, 1e-6);
                  const double px = std::pow(qx, n - 1), py = std::pow(qy, n - 1), sum = px * qx + py * qy;
                  const double k0 = std::pow(sum, 1.0 / n);
                  const double slope = std::hypot(px / a, py / b) * k0 / sum;
                  // The surface leans at the shoulders and over the head: it is nearer than along the
                  // section.
                  const double leans = std::clamp((z - 670.0) / 30.0, 0.0, 1.0) +
                                       0.6 * std::clamp(1.0 - std::abs(z - 445.0) / 45.0, 0.0, 1.0);
                  const double across = (0.9 - 0.6 * leans) * (k0 - 1.0) / slope;
                  const double under = low < perineum ? perineum - p.z() : low - p.z();
                  // Rounded below, toward the thighs.
                  const double lower = under + less, round = 50.0, apart = std::abs(across - lower);
                  const double edge = low < perineum && apart < round
                                          ? 0.25 * (round - apart) * (round - apart) / round
                                          : 0.0;
                  return std::max(std::max(across, lower) + edge, p.z() - high + std::min(less, 4.0));
              },
              {Vec3(-widest, -deepest, std::max(low, perineum) - 1.0), Vec3(widest, deepest, high + 1.0)}});
    if (low < perineum) {
        const double wide = spec.width / 375.0, deep = 0.5 * spec.depth - fraction * 12.0 - inset,
                     less = fraction * 12.0 + inset;
        for (const Side side : {left, right}) {
            body.add(shape::sweep({{side.at(92.0 * wide, -4.0, -150.0), 84.0 * wide - less, deep - 4.0},
                                   {side.at(94.0 * wide, -2.0, -230.0), 88.0 * wide - less, 0.9 * deep},
                                   {side.at(96.0 * wide, 0.0, -380.0), 80.0 * wide - less, 84.0 - less},
                                   {side.at(96.0 * wide, 4.0, -700.0), 66.0 * wide - less, 68.0 - less}},
                                  Vec3::UnitX()),
                     0.0, 55.0);
        }
        body.keep(shape::half_space(Vec3(0, 0, low + less), Vec3(0, 0, -1)));
    }
    // Breasts: fat on the chest, more in some than in others.
    if (high > 350.0) {
        const double full = std::clamp(1.0 + 0.6 * Chance(spec.seed).normal("breasts"), 0.3, 2.2);
        for (const Side side : {left, right}) {
            const Vec3 half(54.0, 15.0 + 4.0 * full, 46.0 + 3.0 * full);
            const Vec3 middle = side.at(78.0 + 2.0 * side.sign, chest_front + 19.0, 302.0 - 5.0 * full);
            body.add(shape::ellipsoid(middle, half - fraction * Vec3(16, 22, 16) - Vec3::Constant(inset)),
                     0.0, 26.0);
        }
    }
    // Arms, from the shoulder to the elbow.
    if (high > 350.0) {
        const Vec3 joint = shoulder_joint(outline.chest), direction = arm_direction(outline.chest);
        const double less = 0.8 * (fraction * 9.0 + inset);
        for (const Side side : {left, right}) {
            const auto at = [&](double along) {
                const Vec3 p = joint + along * direction;
                return side.at(p.x(), p.y(), p.z());
            };
            body.add(shape::sweep({{at(-20), 46 - less, 50 - less},
                                   {at(40), 52 - less, 54 - less},
                                   {at(150), 46 - less, 47 - less},
                                   {at(330 - less), 40 - less, 42 - less}},
                                  Vec3::UnitY()),
                     0.0, 25.0);
        }
    }
    return body.solid();
}

/// What has the texture of soft tissue: the flesh between two heights without lungs, skull and brain.
shape::Solid textured_tissue(const Outline& outline, const Chance& chance, bool with_head, double low,
                             double high) {
    shape::Solid flesh = trunk(outline, 1.0, 0.0);
    const shape::Solid lungs[] = {lung_space(outline.chest, left), lung_space(outline.chest, right)};
    const shape::Solid brain = shape::moved(shape::grown(cranial_cavity(chance), 8.0), at_sella());
    const double wide = high > 330.0 ? 230.0 : 0.5 * outline.spec.width,
                 front = std::min(skin_behind - outline.spec.depth, outline.chest.front);
    flesh.box = {Vec3(-wide, front, low), Vec3(wide, 140.0, high)};
    return {[=, own = flesh.distance](const Vec3& p) {
                double distance = own(p);
                for (const shape::Solid& lung : lungs)
                    if (p.z() > lung.box.min().z() && p.z() < lung.box.max().z())
                        distance = std::max(distance, -lung.distance(p));
                if (with_head && p.z() > brain.box.min().z())
                    distance = std::max(distance, -brain.distance(p));
                return distance;
            },
            flesh.box};
}

TriangleMesh surface_of(const shape::Solid& solid, double cell) {
    shape::Compound compound;
    compound.add(solid);
    return shape::polygonised(compound, cell).outer;
}

}  // namespace

void Bones::add(const shape::Surfaces& surfaces, const Eigen::Isometry3d& place, double plaques) {
    const std::size_t first = outer.triangles.size();
    for (const auto& [from, to] : {std::pair{&surfaces.outer, &outer}, {&surfaces.core, &core}}) {
        TriangleMesh mesh = geometry::ordered(*from);
        for (Vec3& v : mesh.vertices) v = place * v;
        append(*to, mesh);
    }
    added_.push_back({first, outer.triangles.size(), plaques});
}

void Bones::add_mirrored(const shape::Surfaces& surfaces, const Eigen::Isometry3d& place, double plaques) {
    shape::Surfaces mirrored = surfaces;
    for (TriangleMesh* mesh : {&mirrored.outer, &mirrored.core}) {
        for (Vec3& v : mesh->vertices) v.x() = -v.x();
        for (auto& triangle : mesh->triangles) std::swap(triangle[1], triangle[2]);
    }
    add(mirrored, place, plaques);
}

void Bones::add_canal(const std::vector<shape::Station>& course, std::uint64_t field,
                      const Eigen::Isometry3d& place, bool mirror) {
    shape::Compound canal;
    canal.add(shape::sweep(course, Vec3::UnitX(), 2.0, [field](double along, double angle) {
        return 1.1 * shape::noise(Vec3(along, 7.0 * std::cos(angle), 7.0 * std::sin(angle)), 14.0, field) +
               0.7 * shape::noise(Vec3(along, 7.0 * std::cos(angle), 7.0 * std::sin(angle)), 5.0, field + 1);
    }));
    TriangleMesh mesh = shape::polygonised(canal, 2.4).outer;
    for (Vec3& v : mesh.vertices) {
        if (mirror) v.x() = -v.x();
        v = place * v;
    }
    if (mirror)
        for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
    append(canals, mesh);
}

void Bones::add_poor_marrow(const Vec3& middle, const Vec3& axis, double along, double across, double by) {
    TextureBlob blob;
    blob.middle = middle.cast<float>();
    blob.axis = axis.cast<float>();
    blob.radius = static_cast<float>(across);
    blob.elongation = static_cast<float>(along / across);
    blob.fraction = static_cast<float>(-by);
    trabeculae.push_back(blob);
}

void Bones::add_grain(const shape::Compound& shape, double per_area, double deepest, double coarsest,
                      const Vec3& along, std::uint64_t field, const Eigen::Isometry3d& place, bool mirror) {
    const auto mirrored = [mirror](Vec3 p) {
        if (mirror) p.x() = -p.x();
        return p;
    };
    const Vec3 way = place.linear() * mirrored(along);
    TexturePattern pattern;
    pattern.kind = TexturePattern::Kind::Grain;
    pattern.field = field;
    pattern.numbers = {per_area, deepest, coarsest, way.x(), way.y(), way.z(), balance_};
    balance_ = 0.0;
    pattern.from = added_.back().from;
    pattern.to = added_.back().to;
    const Eigen::Isometry3d back = place.inverse();
    pattern.choose(outer, [&](const TextureTry& at) {
        const shape::Compound::Value value = shape.at(mirrored(back * at.middle));
        return value.distance <= -(value.shell + 0.2 + at.radius * (0.5 + 0.3 * at.length));
    });
    patterns.push_back(std::move(pattern));
}

void Bones::add_plaques(std::uint64_t field) {
    for (const Added& part : added_) {
        TexturePattern pattern;
        pattern.kind = TexturePattern::Kind::Plaques;
        pattern.field = geometry::mixed(field + part.from);
        pattern.numbers[0] = part.plaques;
        pattern.from = part.from;
        pattern.to = part.to;
        patterns.push_back(std::move(pattern));
    }
}

void Bones::add_trabecula(const Vec3& from, const Vec3& to, double radius) {
    TextureBlob blob;
    blob.middle = (0.5 * (from + to)).cast<float>();
    blob.axis = (to - from).normalized().cast<float>();
    blob.radius = static_cast<float>(radius);
    blob.elongation = static_cast<float>(0.6 * (to - from).norm() / radius);
    blob.fraction = 0.5f;
    balance_ += content(blob);
    trabeculae.push_back(blob);
}

/// The sum of twelve uniform numbers, drawn again beyond ±2.5, is nearly normal; 0.961 is its deviation.
double Chance::normal(std::string_view quantity, int index) const {
    if (!varied()) return 0.0;
    geometry::Random uniform(field(quantity, index));
    for (;;) {
        double sum = -6.0;
        for (int k = 0; k < 12; ++k) sum += uniform();
        if (std::abs(sum) <= 2.5) return sum / 0.961;
    }
}

std::uint64_t Chance::field(std::string_view quantity, int index) const {
    return geometry::mixed(geometry::fnv1a(quantity, geometry::mixed(seed_ + geometry::golden_step)) +
                           static_cast<std::uint64_t>(index) * geometry::golden_step);
}

Askew::Askew(const Chance& chance)
    : varied_(chance.varied()),
      fields_{chance.field("askew", 0), chance.field("askew", 1), chance.field("askew", 2)} {}

Vec3 Askew::operator()(const Vec3& p) const {
    if (!varied_) return Vec3::Zero();
    // The skull is narrower, and its base has parts of a few millimetres.
    const double up = std::clamp((p.z() - 470.0) / 60.0, 0.0, 1.0);
    const double from = 28.0 - 22.0 * up, to = 85.0 - 45.0 * up, most = 7.0 - 3.4 * up;
    const double t = std::clamp((std::abs(p.x()) - from) / (to - from), 0.0, 1.0);
    if (t == 0.0) return Vec3::Zero();
    Vec3 by;
    for (int k = 0; k < 3; ++k)
        by[k] = shape::noise(p, 130.0 - 50.0 * up, fields_[static_cast<std::size_t>(k)]) +
                0.3 * shape::noise(p, 48.0, fields_[static_cast<std::size_t>(k)] + 1);
    return most * t * t * (3.0 - 2.0 * t) * by;
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

std::vector<TissueLayer> make_patient(const PatientSpec& spec, std::vector<LayerTexture>* textures) {
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

    const Chance chance(spec.seed);
    const Askew askew(chance);
    std::vector<VesselSample> vessels;
    double front = skin_at(chest_middle).middle - skin_at(chest_middle).half_depth;
    for (const VesselSample& sample : spec.vessels) {
        const Vec3 place = sample.place - spec.origin;
        // Where it is once all that makes room for it is askew.
        Vec3 straight = place;
        for (int k = 0; k < 3; ++k) straight = place - askew(straight);
        vessels.push_back({straight, sample.radius});
        // Sternum and chest wall lie in front of the foremost vessel.
        if (place.z() > chest.low && place.z() < 380.0)
            front = std::min(front, place.y() - sample.radius - 34.0);
    }
    // Arms lie beside the trunk when the head is looked at, else above the head, out of the beam.
    const bool arms_down = spec.upper.z() - spec.origin.z() > 520.0 ||
                           std::any_of(vessels.begin(), vessels.end(), [](const VesselSample& v) {
                               return std::abs(v.place.x()) > 150.0 && v.place.z() < 340.0;
                           });
    const Chest thorax{front, vessels, arms_down};
    const Outline outline{spec, thorax, low, high};

    Bones bones;
    // Bones that no view reaches are left out.
    constexpr double beyond = 60.0;
    add_spine(bones, chance, std::max(low + 20.0, from - beyond), std::min(high - 20.0, to + beyond));
    if (with_abdomen && from < 40.0) add_pelvis(bones, chance, low + 24.0);
    if (with_chest) add_cage(bones, thorax, chance, to > 340.0);
    if (with_head && to > 560.0) add_head_bones(bones, chance);

    bones.add_plaques(chance.field("plaques of the cortex"));

    std::vector<TissueLayer> layers;
    layers.push_back({"body", Material::SoftTissue, Material::Air,
                      surface_of(trunk(outline, 0.0, 0.0), skin_cell), false});
    layers.push_back({"trunk", Material::SoftTissue, Material::Adipose,
                      surface_of(trunk(outline, 1.0, 0.0), skin_cell), false});
    layers.push_back({"bones", Material::CorticalBone, Material::SoftTissue, std::move(bones.outer), false});
    layers.back().texture_blobs = std::move(bones.trabeculae);
    layers.push_back(
        {"marrow", Material::TrabecularBone, Material::CorticalBone, std::move(bones.core), false});
    if (!bones.canals.triangles.empty())
        layers.push_back(
            {"yellow marrow", Material::Adipose, Material::TrabecularBone, std::move(bones.canals), false});
    if (with_abdomen) {
        // Behind the wall of the belly, in front of the muscles of the back, above the floor of the pelvis
        // and below the diaphragm.
        const shape::Solid wall = trunk({spec, thorax, -300.0, 300.0}, 1.0, 17.0);
        const shape::Solid cavity{
            [inner = wall.distance](const Vec3& p) {
                const double floor = -150.0 - 0.25 * p.y() + 0.0020 * p.x() * p.x();
                const double narrow = std::abs(p.x()) - 90.0 - 0.9 * std::max(0.0, p.z() + 90.0);
                // Curved like the back wall and the diaphragm: a flat face seen edge-on is a bar in the
                // image.
                const double back = 52.0 - 0.0010 * p.x() * p.x() - 0.0004 * p.z() * p.z(),
                             top = 158.0 - 0.0016 * p.x() * p.x() - 0.0022 * p.y() * p.y();
                return std::max({inner(p), p.y() - back, floor - p.z(), p.z() - top, 0.7 * narrow});
            },
            {Vec3(-0.5 * spec.width, -spec.depth, -220.0), Vec3(0.5 * spec.width, 55.0, 160.0)}};
        add_abdomen_layers(layers, chance, trunk(outline, 1.0, 0.0), cavity, skin_behind - spec.depth,
                           spec.bowel_gas);
    }
    if (with_chest) add_chest_layers(layers, thorax, chance);
    if (with_head && to > 560.0) add_head_layers(layers, chance);
    const shape::Solid tissue =
        tabulated(textured_tissue(outline, chance, with_head, std::max(low, from - beyond),
                                  std::min(high, to + beyond)),
                  11.0);
    add_skin_and_muscles(layers, chance, trunk(outline, 0.0, 0.0), tissue, thorax, skin_behind - spec.depth);
    std::vector<LayerTexture> of(layers.size());
    of[1].patterns.push_back(tissue_texture(chance, tissue, spec.origin));
    of[2].patterns = std::move(bones.patterns);
    geometry::Allowance unlimited{std::numeric_limits<std::size_t>::max()};
    for (std::size_t l = 0; l < layers.size(); ++l) {
        TissueLayer& layer = layers[l];
        for (Vec3& v : layer.mesh.vertices) v = geometry::on_grid(v + askew(v) + spec.origin, corner_step);
        for (TextureBlob& blob : layer.texture_blobs) {
            const Vec3 middle = blob.middle.cast<double>();
            blob.middle = (middle + askew(middle) + spec.origin).cast<float>();
        }
        of[l].singles = layer.texture_blobs.size();
        for (const TexturePattern& pattern : of[l].patterns)
            pattern.draw(layer.mesh, layer.texture_blobs, unlimited);
    }
    if (textures) *textures = std::move(of);
    return layers;
}

}  // namespace render
