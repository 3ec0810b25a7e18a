#include "engine/exercise/distal_trees.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "engine/blood/blood_flow.h"
#include "engine/exercise/imaging.h"
#include "physics/geometry/hash.h"
#include "physics/geometry/mesh_query.h"
#include "physics/geometry/mesh_topology.h"
#include "physics/geometry/random.h"

namespace exercise {
namespace {

using geometry::Vec3;

constexpr double smallest_radius = 0.15;  // of a tree's arteries [mm]
constexpr double trunk_radius = 5;        // from which an end is that of a trunk, which goes on [mm]
constexpr int most_terminals = 1200, fewest_terminals = 6;
constexpr double longest_piece = 6;  // [mm]
/// An organ this far from an end is not reached by it [mm].
constexpr double organ_reach = 150;

Vec3 in_unit_ball(geometry::Random& random) {
    while (true) {
        const double x = random.between(-1, 1), y = random.between(-1, 1), z = random.between(-1, 1);
        const Vec3 p(x, y, z);
        if (p.squaredNorm() <= 1) return p;
    }
}

std::uint64_t seed_of(const std::string& name) {
    geometry::Hash hash;
    hash.add(name.data(), name.size());
    return hash.value();
}

/// Shape of the tissue ahead of an end whose organ is not drawn, in radii of the end: how far its middle lies
/// ahead, and its half axes along and across (estimates).
struct Ahead {
    double middle, along, across;
};
Ahead tissue_ahead(const std::string& organ) {
    if (organ == "leg" || organ == "arm") return {30, 28, 8};
    if (organ == "gut") return {22, 18, 25};
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
        const double fill = 0.5 + 0.5 * std::cos(std::numbers::pi * past);
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
    fade_out(nearest->centre, nearest->outward_normal, 2.5 * nearest->radius, nearest->radius, 0, pieces,
             [](double) {});
    const auto node = static_cast<std::uint32_t>(blood.outlets.size()) * blood::DistalArteries::bins + source;
    for (std::size_t k = first; k < pieces.size(); ++k) pieces[k].node = static_cast<std::uint32_t>(node);
}

class Grower {
public:
    Grower(const blood::Outlet& outlet, int index, std::vector<render::VesselPiece>& pieces)
        : outlet_(outlet), index_(index), random_(seed_of(outlet.end)), pieces_(pieces) {}

    /// Divides the points among branches.
    void fill(std::vector<Vec3> territory) {
        const double terminals = static_cast<double>(territory.size());
        exponent_ = std::log(terminals) / std::log(std::max(1.5, outlet_.radius / smallest_radius));
        terminals_ = terminals;
        std::vector<Vec3*> all;
        for (Vec3& p : territory) all.push_back(&p);
        const std::size_t first = pieces_.size();
        grow(all, outlet_.place, outlet_.direction, 0);
        set_nodes(first);
    }
    /// Goes on as a tube that fades.
    void go_on() {
        const std::size_t first = pieces_.size();
        fade_out(outlet_.place, outlet_.direction, 12 * outlet_.radius, outlet_.radius, 0.35, pieces_,
                 [this](double part) { times_.push_back(part); });
        latest_ = 1;
        set_nodes(first);
    }

private:
    double radius_of(std::size_t points) const {
        return outlet_.radius * std::pow(static_cast<double>(points) / terminals_, 1 / exponent_);
    }

    void grow(std::vector<Vec3*>& points, const Vec3& from, const Vec3& heading, double time) {
        const double radius = radius_of(points.size());
        Vec3 middle = Vec3::Zero();
        for (const Vec3* p : points) middle += *p / static_cast<double>(points.size());
        const Vec3 to_middle = middle - from;
        const bool last = points.size() == 1;
        // Far from its territory an artery runs there; within, it divides on the way to the middle.
        const double part = last ? 1 : random_.between(0.3, 0.55);
        const Vec3 to = from + part * to_middle;
        const double length = (to - from).norm();
        Vec3 direction = length > 1e-6 ? Vec3((to - from) / length) : heading;
        const Vec3 end_heading = draw(from, heading, to, direction, radius, time);
        // Resting velocity is proportional to radius in Murray's trees.
        const double later = time + length / radius;
        if (last) return;
        // Divides by a plane that holds the way, across the widest direction.
        Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
        for (const Vec3* p : points) {
            const Vec3 off = *p - middle;
            const Vec3 across = off - off.dot(direction) * direction;
            spread += across * across.transpose();
        }
        const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(spread);
        const Vec3 widest = axes.eigenvectors().col(2);
        std::ranges::sort(points,
                          [&](const Vec3* a, const Vec3* b) { return a->dot(widest) < b->dot(widest); });
        const double fraction = random_() < 0.5 ? random_.between(0.2, 0.5) : random_.between(0.5, 0.8);
        const auto cut = std::clamp<std::size_t>(
            static_cast<std::size_t>(fraction * static_cast<double>(points.size())), 1, points.size() - 1);
        std::vector<Vec3*> left(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(cut)),
            right(points.begin() + static_cast<std::ptrdiff_t>(cut), points.end());
        points.clear();
        points.shrink_to_fit();
        grow(left, to, end_heading, later);
        grow(right, to, end_heading, later);
    }

    /// A cubic from one heading to the next, in straight pieces; returns the heading at its end.
    Vec3 draw(const Vec3& from, const Vec3& heading, const Vec3& to, const Vec3& direction, double radius,
              double time) {
        const double length = (to - from).norm();
        if (length < 1e-3) return heading;
        const Vec3 wobble = 0.15 * in_unit_ball(random_);
        // A vessel that sets out backwards would loop.
        const double kept = std::clamp(0.5 * heading.dot(direction) + 0.2, 0.0, 0.5);
        const Vec3 out = (kept * heading + (1 - kept) * direction).normalized(),
                   in = (direction + wobble).normalized();
        const int count =
            std::clamp(static_cast<int>(std::ceil(length / std::min(longest_piece, 4 * radius))), 2, 12);
        Vec3 at = from;
        for (int k = 1; k <= count; ++k) {
            const double t = static_cast<double>(k) / count, t2 = t * t, t3 = t2 * t;
            const Vec3 next = (2 * t3 - 3 * t2 + 1) * from + (t3 - 2 * t2 + t) * length * out +
                              (3 * t2 - 2 * t3) * to + (t3 - t2) * length * in;
            // Two branches share the place where they leave their parent.
            const bool shared = time > 0 && ((at + next) / 2 - from).norm() < 1.2 * radius;
            pieces_.push_back({at, next, static_cast<float>(radius), shared ? 0.5f : 1.0f, 0});
            times_.push_back(time + (t - 0.5 / count) * length / radius);
            latest_ = std::max(latest_, times_.back());
            at = next;
        }
        return in;
    }

    void set_nodes(std::size_t first) {
        constexpr int bins = blood::DistalArteries::bins;
        for (std::size_t k = first; k < pieces_.size(); ++k) {
            const int bin = std::min(bins - 1, static_cast<int>(times_[k - first] / latest_ * bins));
            pieces_[k].node = static_cast<std::uint32_t>(index_ * bins + bin);
        }
    }

    const blood::Outlet& outlet_;
    int index_;
    geometry::Random random_;
    std::vector<render::VesselPiece>& pieces_;
    std::vector<double> times_;  // at which blood reaches each piece, in radii of way
    double latest_ = 1e-9, exponent_ = 3, terminals_ = 1;
};

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

std::vector<Vec3> points_ahead(const blood::Outlet& outlet, int count) {
    const Ahead shape = tissue_ahead(outlet.organ);
    const Vec3 u = outlet.direction.unitOrthogonal(), v = outlet.direction.cross(u);
    geometry::Random random(seed_of(outlet.end) + 1);
    std::vector<Vec3> points;
    for (int k = 0; k < count; ++k) {
        const Vec3 p = outlet.radius * in_unit_ball(random);
        points.push_back(outlet.place +
                         (shape.middle * outlet.radius + shape.along * p.x()) * outlet.direction +
                         shape.across * (p.y() * u + p.z() * v));
    }
    return points;
}

int terminals_of(double radius) {
    return std::clamp(static_cast<int>(std::pow(radius / smallest_radius, 3)), fewest_terminals,
                      most_terminals);
}

}  // namespace

std::vector<render::VesselPiece> distal_trees(const anatomy::Anatomy& anatomy, const blood::BloodFlow& blood,
                                              const std::vector<render::TissueLayer>& layers) {
    const std::vector<blood::Outlet>& outlets = blood.outlets;
    std::vector<std::vector<Vec3>> territories(outlets.size());
    struct Supplier {
        std::size_t outlet;
        double most;  // points
        std::size_t before;
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
            suppliers[layer].push_back({k, std::ceil(fraction * terminals_of(outlets[k].radius)), 0});
        }
    }
    for (std::size_t layer = 0; layer < layers.size(); ++layer) {
        if (suppliers[layer].empty()) continue;
        double wanted = 0;
        for (Supplier& supplier : suppliers[layer]) {
            wanted += supplier.most;
            supplier.before = territories[supplier.outlet].size();
        }
        for (const Vec3& p : points_in(layers[layer].mesh, static_cast<int>(2 * wanted))) {
            const Supplier* nearest = nullptr;
            double least = std::numeric_limits<double>::infinity();
            for (const Supplier& supplier : suppliers[layer]) {
                // A wider end reaches farther.
                const blood::Outlet& outlet = outlets[supplier.outlet];
                const double away = (p - outlet.place).norm() / outlet.radius;
                if (away < least) least = away, nearest = &supplier;
            }
            std::vector<Vec3>& territory = territories[nearest->outlet];
            if (static_cast<double>(territory.size() - nearest->before) < nearest->most)
                territory.push_back(p);
        }
    }
    std::vector<render::VesselPiece> pieces;
    for (std::size_t k = 0; k < outlets.size(); ++k) {
        if (!(outlets[k].arterial > 0)) continue;
        Grower grower(outlets[k], static_cast<int>(k), pieces);
        if (outlets[k].radius >= trunk_radius) {
            grower.go_on();
            continue;
        }
        std::vector<Vec3>& territory = territories[k];
        if (4 * static_cast<int>(territory.size()) < terminals_of(outlets[k].radius))
            territory = points_ahead(outlets[k], terminals_of(outlets[k].radius));
        grower.fill(std::move(territory));
    }
    for (std::size_t k = 0; k < blood.sources.size(); ++k)
        add_source(anatomy, blood, static_cast<int>(k), pieces);
    return pieces;
}

std::uint32_t distal_nodes(const blood::BloodFlow& blood) {
    return static_cast<std::uint32_t>(blood.outlets.size() * blood::DistalArteries::bins +
                                      blood.sources.size());
}

std::vector<float> distal_iodine(const blood::ContrastFlow& contrast) {
    std::vector<float> iodine(contrast.distal_iodine().begin(), contrast.distal_iodine().end());
    for (const blood::BloodFlow::Source& source : contrast.blood().sources)
        iodine.push_back(contrast.iodine()[source.cell]);
    return iodine;
}

}  // namespace exercise
