#include "engine/exercise/distal_trees.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "engine/blood/blood_flow.h"
#include "engine/exercise/imaging.h"
#include "engine/exercise/venous_trees.h"
#include "engine/exercise/vessel_growth.h"
#include "physics/geometry/maths.h"
#include "physics/geometry/mesh_query.h"
#include "physics/geometry/mesh_topology.h"
#include "physics/geometry/random.h"

namespace exercise {
namespace {

using geometry::Vec3;

constexpr double smallest_radius = 0.15;  // of a tree's arteries [mm]
constexpr int most_terminals = 1200, fewest_terminals = 6;
/// An organ this far from an end is not reached by it [mm].
constexpr double organ_reach = 150;
constexpr double cubic_mm_per_ml = 1000;

/// Shape of the tissue ahead of an end whose organ is not drawn, in radii of the end: how far its middle lies
/// ahead, and its half axes along and across (estimates).
struct Ahead {
    double middle, along, across;
};
Ahead tissue_ahead(const std::string& organ) {
    if (organ == "leg" || organ == "arm") return {30, 28, 8};
    if (organ == "gut") return {24, 22, 34};
    if (organ == "face") return {25, 22, 14};
    if (organ == "heart") return {25, 22, 18};
    return {14, 12, 10};
}

/// A straight vessel whose contrast fades to nothing; calls add(part of the length) for each piece.
template <class Add>
void fade_out(const Vec3& from, const Vec3& direction, double length, double radius, double clear,
              std::vector<render::VesselPiece>& pieces, Add add) {
    constexpr int count = 40;
    for (int k = 0; k < count; ++k) {
        const double part = (k + 0.5) / count;
        const double past = std::max(0.0, part - clear) / (1 - clear);
        const double fill = 0.5 + 0.5 * geometry::cos(std::numbers::pi * past);
        pieces.push_back({from + k * length / count * direction, from + (k + 1) * length / count * direction,
                          static_cast<float>(radius * (1 - 0.15 * part)), static_cast<float>(fill), 0});
        add(part);
    }
}

/// The vessel goes on beyond the end that blood comes in by.
void add_source(const anatomy::Anatomy& anatomy, const blood::BloodFlow& blood, int source,
                std::vector<render::VesselPiece>& pieces) {
    const Vec3& place = blood.cells[blood.sources[source].cell].centre;
    const geometry::OpenEnd* nearest = nullptr;
    for (const anatomy::VesselEnd& end : anatomy.ends)
        if (!nearest || (end.opening.centre - place).norm() < (nearest->centre - place).norm())
            nearest = &end.opening;
    if (!nearest || (nearest->centre - place).norm() > 3 * nearest->radius) return;
    const std::size_t first = pieces.size();
    fade_out(nearest->centre, nearest->outward_normal, 10 * nearest->radius, nearest->radius, 0, pieces,
             [](double) {});
    const auto node = static_cast<std::uint32_t>(blood.outlets.size()) * blood::DistalArteries::bins + source;
    for (std::size_t k = first; k < pieces.size(); ++k) pieces[k].node = static_cast<std::uint32_t>(node);
}

/// Goes on as a tube that fades.
void add_trunk(const blood::Outlet& outlet, std::uint32_t node, std::vector<render::VesselPiece>& pieces) {
    constexpr int bins = blood::DistalArteries::bins;
    fade_out(outlet.place, outlet.direction, 12 * outlet.radius, outlet.radius, 0.35, pieces,
             [&](double part) { pieces.back().node = node + static_cast<std::uint32_t>(part * bins); });
}

/// Points spread evenly in a layer's mesh.
std::vector<Vec3> points_in(const geometry::TriangleMesh& mesh, int count) {
    Eigen::AlignedBox3d box;
    for (const Vec3& v : mesh.vertices) box.extend(v);
    const geometry::MeshQuery query(mesh);
    geometry::Random random(mesh.vertices.size());
    std::vector<Vec3> points;
    for (int tries = 0; tries < 20 * count && static_cast<int>(points.size()) < count; ++tries) {
        const double x = random(), y = random(), z = random();
        const Vec3 p = box.min() + Vec3(x, y, z).cwiseProduct(box.sizes());
        if (query.encloses(p)) points.push_back(p);
    }
    return points;
}

bool is_external_carotid(const blood::Outlet& outlet) {
    return outlet.branch.ends_with("LECA") || outlet.branch.ends_with("RECA");
}

std::vector<Vec3> points_ahead(const blood::Outlet& outlet, int count) {
    const Ahead shape = tissue_ahead(is_external_carotid(outlet) ? "face" : outlet.organ);
    const Vec3 u = outlet.direction.unitOrthogonal(), v = outlet.direction.cross(u);
    geometry::Random random(seed_of(outlet.end) + 1);
    std::vector<Vec3> points;
    for (int k = 0; k < count; ++k) {
        const Vec3 p = outlet.radius * in_unit_ball(random);
        Vec3 off = shape.along * p.x() * outlet.direction + shape.across * (p.y() * u + p.z() * v);
        if (outlet.organ == "gut") off.y() *= 0.4;  // the mesentery lies flat
        points.push_back(outlet.place + shape.middle * outlet.radius * outlet.direction + off);
    }
    return points;
}

int terminals_of(const blood::Outlet& outlet) {
    // Arteries of the brain keep their width over long ways (as angiograms show).
    const double more = outlet.organ == "brain" ? 4 : 1;
    return std::clamp(static_cast<int>(more * geometry::pow(outlet.radius / smallest_radius, 3)),
                      fewest_terminals, most_terminals);
}

/// How much vessels of an organ wind: of the brain they follow its convolutions (estimates) [-].
double winding_of(const std::string& organ) {
    return organ == "brain" ? 1.0 : organ == "gut" ? 0.25 : organ == "heart" ? 0.35 : 0.2;
}

/// The points of each outlet's tissue, from which its tree grows.
std::vector<std::vector<Vec3>> territories_of(const std::vector<blood::Outlet>& outlets,
                                              const std::vector<render::TissueLayer>& layers) {
    std::vector<std::vector<Vec3>> territories(outlets.size());
    struct Supplier {
        std::size_t outlet;
        double most;    // points
        double tissue;  // [mm³]
        std::vector<Vec3> points;
    };
    std::vector<std::vector<Supplier>> suppliers(layers.size());
    for (std::size_t k = 0; k < outlets.size(); ++k) {
        if (outlets[k].organ == "heart") continue;  // mostly chambers; its arteries run over the wall
        if (outlets[k].radius >= trunk_radius) continue;
        const std::vector<int> supplied = supplied_layers(layers, outlets[k]);
        double volume = 0;
        for (const int layer : supplied) volume += geometry::signed_volume(layers[layer].mesh);
        for (const int layer : supplied) {
            Eigen::AlignedBox3d box;
            for (const Vec3& v : layers[layer].mesh.vertices) box.extend(v);
            if (box.exteriorDistance(outlets[k].place) > organ_reach) continue;
            const double fraction = geometry::signed_volume(layers[layer].mesh) / volume;
            suppliers[layer].push_back({k,
                                        std::ceil(fraction * terminals_of(outlets[k])),
                                        fraction * cubic_mm_per_ml * outlets[k].tissue,
                                        {}});
        }
    }
    for (std::size_t layer = 0; layer < layers.size(); ++layer) {
        if (suppliers[layer].empty()) continue;
        double wanted = 0;
        for (const Supplier& supplier : suppliers[layer]) wanted += supplier.most;
        const std::vector<Vec3> points = points_in(layers[layer].mesh, static_cast<int>(2 * wanted));
        const double each = geometry::signed_volume(layers[layer].mesh) /
                            static_cast<double>(std::max<std::size_t>(points.size(), 1));  // [mm³]
        for (const Vec3& p : points) {
            Supplier* nearest = nullptr;
            double least = std::numeric_limits<double>::infinity();
            for (Supplier& supplier : suppliers[layer]) {
                // A wider end reaches farther.
                const blood::Outlet& outlet = outlets[supplier.outlet];
                const double away = (p - outlet.place).norm() / outlet.radius;
                if (away < least) least = away, nearest = &supplier;
            }
            nearest->points.push_back(p);
        }
        for (Supplier& supplier : suppliers[layer]) {
            // Blood for a small part of the territory, as through a communicating artery, has the nearest.
            constexpr double enough = 0.5;  // of the territory (estimate)
            const double own = each * static_cast<double>(supplier.points.size());
            if (supplier.tissue < enough * own) {
                std::vector<double> away;
                for (const Vec3& p : supplier.points)
                    away.push_back((p - outlets[supplier.outlet].place).norm());
                const auto last =
                    away.begin() +
                    static_cast<std::ptrdiff_t>(supplier.tissue / own * static_cast<double>(away.size()));
                std::nth_element(away.begin(), last, away.end());
                std::erase_if(supplier.points, [&](const Vec3& p) {
                    return (p - outlets[supplier.outlet].place).norm() > *last;
                });
            }
            if (static_cast<double>(supplier.points.size()) > supplier.most)
                supplier.points.resize(static_cast<std::size_t>(supplier.most));
            std::vector<Vec3>& territory = territories[supplier.outlet];
            territory.insert(territory.end(), supplier.points.begin(), supplier.points.end());
        }
    }
    return territories;
}

std::uint32_t first_vein(const blood::BloodFlow& blood) {
    return static_cast<std::uint32_t>(blood.outlets.size() * blood::DistalArteries::bins +
                                      blood.sources.size());
}

}  // namespace

std::vector<render::VesselPiece> distal_trees(const anatomy::Anatomy& anatomy, const blood::BloodFlow& blood,
                                              const std::vector<render::TissueLayer>& layers) {
    constexpr std::uint32_t bins = blood::DistalArteries::bins;
    const std::vector<blood::Outlet>& outlets = blood.outlets;
    std::vector<std::vector<Vec3>> territories = territories_of(outlets, layers);
    std::vector<render::VesselPiece> pieces;
    for (std::size_t k = 0; k < outlets.size(); ++k) {
        const blood::Outlet& outlet = outlets[k];
        if (!(outlet.arterial > 0)) continue;
        const auto node = static_cast<std::uint32_t>(k) * bins;
        if (outlet.radius >= trunk_radius) {
            add_trunk(outlet, node, pieces);
            continue;
        }
        std::vector<Vec3>& territory = territories[k];
        if (static_cast<int>(territory.size()) < fewest_terminals)
            territory = points_ahead(outlet, terminals_of(outlet));
        Root root{outlet.place,    outlet.direction,         outlet.radius,
                  smallest_radius, winding_of(outlet.organ), seed_of(outlet.end)};
        if (is_external_carotid(outlet)) root.winding = 0.7;
        // Their branches leave one after the other.
        if (outlet.organ == "brain") root.least_part = 0.12, root.largest_part = 0.4;
        if (outlet.organ == "gut" || is_external_carotid(outlet))
            root.least_part = 0.1, root.largest_part = 0.3;
        grow_into(territory, root, {node, bins}, pieces);
    }
    for (std::size_t k = 0; k < blood.sources.size(); ++k)
        add_source(anatomy, blood, static_cast<int>(k), pieces);
    add_veins(anatomy, blood, layers, territories, first_vein(blood), pieces);
    return pieces;
}

std::uint32_t distal_nodes(const blood::BloodFlow& blood) {
    return first_vein(blood) + venous_nodes(blood);
}

std::vector<Eigen::Vector3f> distal_moves(const blood::BloodFlow& blood,
                                          const std::vector<Eigen::Vector3f>& of_lumen) {
    constexpr int bins = blood::DistalArteries::bins;
    std::vector<Eigen::Vector3f> moves;
    const auto of_outlets = [&] {
        for (const blood::Outlet& outlet : blood.outlets)
            moves.insert(moves.end(), bins, of_lumen[static_cast<std::size_t>(outlet.cell)]);
    };
    of_outlets();
    for (const blood::BloodFlow::Source& source : blood.sources)
        moves.push_back(of_lumen[static_cast<std::size_t>(source.cell)]);
    of_outlets();
    for (const CollectingVein& vein : collecting_veins(blood)) {
        Eigen::Vector3f mean = Eigen::Vector3f::Zero();
        for (const int outlet : vein.outlets)
            mean += of_lumen[static_cast<std::size_t>(blood.outlets[static_cast<std::size_t>(outlet)].cell)] /
                    static_cast<float>(vein.outlets.size());
        moves.insert(moves.end(), bins, mean);
    }
    return moves;
}

std::vector<float> lumen_iodine(const blood::ContrastFlow& contrast) {
    const blood::BloodFlow& blood = contrast.blood();
    std::vector<float> iodine(contrast.iodine().begin(), contrast.iodine().end());
    for (const blood::BloodFlow::Source& source : blood.sources) {
        const int entry = blood.entry_of(blood.cells[static_cast<std::size_t>(source.cell)].branch);
        for (int cell = entry; cell >= 0; cell = blood.cells[static_cast<std::size_t>(cell)].upstream) {
            float& there = iodine[static_cast<std::size_t>(cell)];
            there = std::max(there, iodine[static_cast<std::size_t>(entry)]);
        }
    }
    return iodine;
}

std::vector<float> distal_iodine(const blood::ContrastFlow& contrast) {
    std::vector<float> iodine(contrast.distal_iodine().begin(), contrast.distal_iodine().end());
    const std::vector<float> lumen = lumen_iodine(contrast);
    for (const blood::BloodFlow::Source& source : contrast.blood().sources)
        iodine.push_back(lumen[static_cast<std::size_t>(source.cell)]);
    add_venous_iodine(contrast, iodine);
    return iodine;
}

}  // namespace exercise
