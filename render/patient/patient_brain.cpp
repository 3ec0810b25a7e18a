#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "physics/geometry/random.h"
#include "render/patient/patient_parts.h"

namespace render {
namespace {

constexpr double brain_cell = 5.0;  // of the grid [mm]

// Borders of the territories as signed distances, in mm from the sella, negative inside. They follow the
// usual maps (Tatu 1998): cerebellum and brain stem under the tentorium; the posterior artery's occipital
// lobe, lower face of the temporal lobe and thalamus; the anterior one's strip along the midline up to the
// parieto-occipital sulcus, without the nuclei; the middle one's the rest.

/// Height of the tentorium: highest at its notch, down to the petrous ridges and the transverse sinuses.
double tentorium(const Vec3& p) {
    return 16.0 - 0.2 * std::abs(p.x()) - 0.24 * std::max(0.0, p.y() - 45.0);
}

double under_tentorium(const Vec3& p) {
    return std::max(0.95 * (p.z() - tentorium(p)), 0.85 * (7.0 + 0.5 * std::abs(p.x()) - p.y()));
}

double of_posterior_artery(const Vec3& p) {
    const double aside = std::abs(p.x());
    const double occipital = 0.95 * (60.0 + 0.24 * (p.z() - 20.0) + 0.30 * aside - p.y());
    const double temporal = std::max(0.95 * (p.z() - tentorium(p) - 12.0 + 0.1 * aside), 4.0 - p.y());
    const Vec3 off = (Vec3(aside, p.y(), p.z()) - Vec3(11.0, 28.0, 22.0)).cwiseQuotient(Vec3(11, 17, 13));
    const double thalamus = 11.0 * (off.norm() - 1.0);
    return std::max(std::min({occipital, temporal, thalamus}), -under_tentorium(p));
}

double of_anterior_artery(const Vec3& p) {
    const double width = 15.0 + 0.12 * std::max(0.0, p.z() - 20.0) + 0.2 * std::max(0.0, -p.y() - 20.0);
    const Vec3 off = (p - Vec3(0.0, 24.0, 14.0)).cwiseQuotient(Vec3(34, 44, 30));
    const double nuclei = 30.0 * (off.norm() - 1.0);
    return std::max(
        {0.97 * (std::abs(p.x()) - width), -nuclei, -under_tentorium(p), -of_posterior_artery(p)});
}

double of_middle_artery(const Vec3& p) {
    return std::max({-under_tentorium(p), -of_posterior_artery(p), -of_anterior_artery(p)});
}

/// A place's own on the map of the territories, whose borders wander by several mm: no two brains share them.
/// One map for all keeps each place in one territory. The falx and the tentorium stay put more than the rest.
Vec3 on_map(const Vec3& p, const std::array<std::uint64_t, 3>& fields) {
    constexpr double wander = 8.0, coarsest = 36.0, finest = 17.0;  // [mm]
    const double off_tentorium = (p.z() - tentorium(p)) / 14.0;
    const double free = wander * (1.0 - 0.6 * std::exp(-off_tentorium * off_tentorium));
    Vec3 by;
    for (int k = 0; k < 3; ++k) by[k] = free * shape::fractal(p, coarsest, finest, 0.6, fields[k]);
    by.x() *= 0.35 + 0.65 * std::min(1.0, std::abs(p.x()) / 24.0);
    return p + by;
}

struct Territory {
    std::string name;
    std::function<double(const Vec3&)> border;  // on the map
};

std::vector<Territory> territories() {
    std::vector<Territory> all;
    for (const Side side : {left, right}) {
        const auto half = [side](double (*border)(const Vec3&)) {
            return [=](const Vec3& p) { return std::max(border(p), -side.sign * p.x()); };
        };
        const std::string name = side.sign > 0.0 ? "left " : "right ";
        all.push_back({name + "ACA", half(of_anterior_artery)});
        all.push_back({name + "MCA", half(of_middle_artery)});
        all.push_back({name + "PCA", half(of_posterior_artery)});
    }
    all.push_back({"cerebellum and stem", under_tentorium});
    return all;
}

/// Grey matter of the nuclei.
bool in_nuclei(const Vec3& p) {
    const Vec3 off = (Vec3(std::abs(p.x()), p.y(), p.z()) - Vec3(19.0, 14.0, 17.0));
    return off.cwiseQuotient(Vec3(13.0, 27.0, 14.0)).norm() < 1.0;
}

/// Convolutions as texture_blobs: more blood in grey matter, less in white matter (2 to 3 times: texts), as
/// much of one as of the other in each territory. Near a border some lie in the neighbour's place, as end
/// branches of two arteries interlock.
std::vector<std::vector<TextureBlob>> convolutions(const std::vector<Territory>& parts, const Chance& chance,
                                                   const shape::Solid& brain,
                                                   const std::array<std::uint64_t, 3>& fields) {
    constexpr double per_volume = 0.0080;      // tries [1/mm³]
    constexpr double cortex = 8.0, mix = 8.0;  // thickness with its folds; reach beyond a border [mm]
    std::vector<std::vector<TextureBlob>> texture_blobs(parts.size());
    std::vector<std::array<double, 2>> contents(parts.size(), {0.0, 0.0});  // less, more [mm³]
    geometry::Random random(chance.field("convolutions"));
    const Vec3 low = brain.box.min(), size = brain.box.sizes();
    const auto tries = static_cast<int>(per_volume * size.prod());
    const auto in_cube = [&random] {
        const double x = random.between(-1, 1), y = random.between(-1, 1), z = random.between(-1, 1);
        return Vec3(x, y, z);
    };
    for (int k = 0; k < tries; ++k) {
        const Vec3 p = low + (0.5 * (in_cube() + Vec3::Ones())).cwiseProduct(size);
        const Vec3 direction = in_cube(), aside = in_cube();
        const double chosen = random(), wide = random(), long_fraction = random();
        const double depth = -brain.distance(p);
        if (depth < 1.0) continue;
        const bool grey = depth < cortex || in_nuclei(p);
        if (!grey && chosen > 0.25) continue;
        Vec3 outward;
        for (int axis = 0; axis < 3; ++axis)
            outward[axis] = brain.distance(p + Vec3::Unit(axis)) - brain.distance(p - Vec3::Unit(axis));
        // Convolutions lie along the surface.
        Vec3 along = direction;
        if (grey && outward.norm() > 0.1) along -= direction.dot(outward) / outward.squaredNorm() * outward;
        TextureBlob blob;
        blob.middle = p.cast<float>();
        blob.axis = (along + Vec3(1e-3, 0, 0)).normalized().cast<float>();
        blob.radius = static_cast<float>(grey ? 2.0 + 2.2 * wide : 3.5 + 5.0 * wide);
        blob.elongation = static_cast<float>(grey ? 1.5 + 2.5 * long_fraction : 1.0 + long_fraction);
        blob.fraction = grey ? 0.8f : -0.6f;
        // Not beyond the falx.
        Vec3 at = p + mix * aside;
        at.x() = p.x() + mix * aside.x() * std::min(1.0, std::abs(p.x()) / 30.0);
        const Vec3 map = on_map(at, fields);
        for (std::size_t t = 0; t < parts.size(); ++t) {
            if (parts[t].border(map) > 0.0) continue;
            contents[t][grey] += std::abs(content(blob));
            texture_blobs[t].push_back(blob);
            break;
        }
    }
    for (std::size_t t = 0; t < parts.size(); ++t) {
        const double least = std::min(contents[t][0], contents[t][1]);
        for (TextureBlob& blob : texture_blobs[t]) {
            const double own = contents[t][blob.fraction > 0.0f];
            blob.fraction *= static_cast<float>(least / std::max(own, 1e-9));
        }
    }
    return texture_blobs;
}

}  // namespace

void add_brain_layers(std::vector<TissueLayer>& layers, const Chance& chance, const shape::Solid& brain,
                      const Eigen::Isometry3d& place) {
    const std::array<std::uint64_t, 3> fields = {chance.field("territories of the brain", 0),
                                                 chance.field("territories of the brain", 1),
                                                 chance.field("territories of the brain", 2)};
    shape::Compound whole;
    whole.add(brain);
    geometry::TriangleMesh mesh = shape::polygonised(whole, 4.0).outer;
    for (Vec3& v : mesh.vertices) v = place * v;
    layers.push_back({"brain", Material::SoftTissue, Material::SoftTissue, std::move(mesh), false});
    const std::vector<Territory> parts = territories();
    std::vector<std::vector<TextureBlob>> texture_blobs = convolutions(parts, chance, brain, fields);
    for (std::size_t t = 0; t < parts.size(); ++t) {
        shape::Compound part;
        part.add(brain);
        // Wandering makes borders steeper than distances.
        part.keep({[&](const Vec3& p) { return 0.5 * parts[t].border(on_map(p, fields)); }, brain.box});
        geometry::TriangleMesh piece = shape::polygonised(part, brain_cell).outer;
        for (Vec3& v : piece.vertices) v = place * v;
        for (TextureBlob& blob : texture_blobs[t]) {
            blob.middle = (place * Vec3(blob.middle.cast<double>())).cast<float>();
            blob.axis = (place.linear() * Vec3(blob.axis.cast<double>())).cast<float>();
        }
        layers.push_back(
            {"brain, " + parts[t].name, Material::SoftTissue, Material::SoftTissue, std::move(piece), false});
        layers.back().texture_blobs = std::move(texture_blobs[t]);
    }
}

}  // namespace render
