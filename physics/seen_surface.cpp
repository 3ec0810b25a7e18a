#include "physics/seen_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "physics/embree_mesh.h"

namespace physics {
namespace {

/// Covers the rounding of square distances to discs in double precision, as a part of them and [mm²].
constexpr double kBoxRounding = 1e-9;
/// Corners may be so far from the plane of a disc [mm].
constexpr double kFlat = 1e-7;

/// Of triangles that meet in the closest point the first counts, whichever way the search came.
bool nearer(const NearestTriangle& a, const NearestTriangle& b) {
    return b.triangle < 0 || a.at.square_distance < b.at.square_distance ||
           (a.at.square_distance == b.at.square_distance && a.triangle < b.triangle);
}

}  // namespace

struct SeenSurface::Scene {
    EmbreeMesh embree;
};

double SeenSurface::Disc::square_distance(const Vec3& x) const {
    const Vec3 d = x - centre;
    const double height = d.dot(normal), least = std::max(0.0, std::abs(height) - kFlat);
    const double beside = std::max(0.0, std::sqrt(std::max(0.0, d.squaredNorm() - height * height)) - radius);
    return least * least + beside * beside;
}

SeenSurface::SeenSurface(const LumenSurface& surface)
    : surface_(surface), scene_(new Scene{EmbreeMesh(surface.mesh())}) {
    for (int t = 0; t < surface.count(); ++t) {
        const LumenSurface::Sphere& sphere = surface.sphere(t);
        Disc disc{sphere.centre, surface.area_normal(t).normalized(), sphere.radius + kFlat};
        for (int k = 0; k < 3; ++k) {
            const double off = std::abs(disc.normal.dot(surface.corner(t, k) - disc.centre));
            if (!(off < kFlat)) disc.normal = Vec3::Zero();
        }
        discs_.push_back(disc);
    }
}

SeenSurface::~SeenSurface() = default;

struct SeenSurface::Search {
    const SeenSurface& surface;
    const SeenStations& seen;
    Vec3 x;
    NearestTriangle best = {};
    double reach = std::numeric_limits<double>::infinity();  // distance of the best [mm]

    bool look_at(int t) {
        if (!seen(t)) return false;
        // Discs tell most of the triangles that Embree's boxes let pass.
        if (surface.discs_[t].square_distance(x) > best_square() * (1 + kBoxRounding) + kBoxRounding)
            return false;
        const LumenSurface& mesh = surface.surface_;
        const TrianglePoint p = closest_point(mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2), x);
        if (!nearer({t, p}, best)) return false;
        best = {t, p};
        reach = std::sqrt(p.square_distance);
        return true;
    }
    double best_square() const {
        return best.triangle >= 0 ? best.at.square_distance : std::numeric_limits<double>::infinity();
    }
    /// A little more than the distance, for boxes that Embree keeps in single precision.
    float radius() const { return static_cast<float>(1.0001 * reach + 1e-3); }

    static bool visit(RTCPointQueryFunctionArguments* arguments) {
        auto& search = *static_cast<Search*>(arguments->userPtr);
        if (!search.look_at(static_cast<int>(arguments->primID))) return false;
        arguments->query->radius = std::min(arguments->query->radius, search.radius());
        return true;
    }
};

NearestTriangle SeenSurface::nearest(const Vec3& x, int seed, const SeenStations& seen) const {
    Search search{*this, seen, x};
    float radius = std::numeric_limits<float>::infinity();
    if (seed >= 0 && search.look_at(seed)) radius = search.radius();
    scene_->embree.near(x, radius, &Search::visit, &search);
    return search.best;
}

struct SeenSurface::Gathering {
    Patch& patch;
    const SeenStations& seen;
    double square_reach;

    static bool visit(RTCPointQueryFunctionArguments* arguments) {
        auto& g = *static_cast<Gathering*>(arguments->userPtr);
        const int t = static_cast<int>(arguments->primID);
        if (g.seen(t) && g.patch.surface_->discs_[t].square_distance(g.patch.centre_) <= g.square_reach)
            g.patch.add(t);
        return false;
    }
};

void SeenSurface::Patch::add(const Four& from, int which) {
    const int at = count_++ % 4;
    if (at == 0) {
        fours_.emplace_back();
        fours_.back().x.setConstant(1e15f);  // never near
        for (auto column :
             {&Four::y, &Four::z, &Four::normal_x, &Four::normal_y, &Four::normal_z, &Four::radius})
            (fours_.back().*column).setZero();
    }
    for (auto column :
         {&Four::x, &Four::y, &Four::z, &Four::normal_x, &Four::normal_y, &Four::normal_z, &Four::radius})
        (fours_.back().*column)[at] = (from.*column)[which];
    fours_.back().triangle[at] = from.triangle[which];
}

void SeenSurface::Patch::add(int triangle) {
    const Disc& disc = surface_->discs_[triangle];
    const Eigen::Vector3f from = (disc.centre - centre_).cast<float>(), normal = disc.normal.cast<float>();
    Four one;
    one.x[0] = from.x(), one.y[0] = from.y(), one.z[0] = from.z();
    one.normal_x[0] = normal.x(), one.normal_y[0] = normal.y(), one.normal_z[0] = normal.z();
    one.radius[0] = static_cast<float>(disc.radius);
    one.triangle[0] = triangle;
    add(one, 0);
}

// A point of the ball is no farther from the surface than the middle is, and `reach`; from the middle to
// what is nearest to it is `reach` more.

void SeenSurface::Patch::gather(const SeenSurface& surface, const Vec3& centre, double reach, int seed,
                                const SeenStations& seen) {
    const NearestTriangle middle = surface.nearest(centre, seed, seen);
    surface_ = &surface;
    centre_ = centre;
    far_ = std::sqrt(middle.at.square_distance) + 2 * reach;
    rounding_ = 1e-5 * (1 + far_ * far_);
    count_ = 0;
    fours_.clear();
    if (middle.triangle < 0) return;
    Gathering gathering{*this, seen, far_ * far_ + rounding_};
    surface.scene_->embree.near(centre, static_cast<float>(1.0001 * far_ + 1e-3), &Gathering::visit,
                                &gathering);
}

void SeenSurface::Patch::gather(const Patch& whole, const Vec3& middle, double reach) {
    surface_ = whole.surface_;
    centre_ = whole.centre_;
    rounding_ = whole.rounding_;
    far_ = std::sqrt(whole.nearest(middle).at.square_distance) + 2 * reach;
    count_ = 0;
    fours_.clear();
    const auto limit = static_cast<float>(far_ * far_ + rounding_);
    const Eigen::Vector3f from = (middle - centre_).cast<float>();
    for (const Four& four : whole.fours_) {
        const Four::Column low = four.square_distance(from);
        if (low.minCoeff() > limit) continue;
        for (int k = 0; k < 4; ++k)
            if (low[k] <= limit) add(four, k);
    }
}

NearestTriangle SeenSurface::Patch::nearest(const Vec3& x) const {
    const Eigen::Vector3f from = (x - centre_).cast<float>();
    const std::size_t count = fours_.size();
    distances_.resize(count);
    Four::Column least = Four::Column::Constant(std::numeric_limits<float>::infinity());
    for (std::size_t f = 0; f < count; ++f) {
        distances_[f] = fours_[f].square_distance(from);
        least = least.min(distances_[f]);
    }
    NearestTriangle best;
    const LumenSurface& mesh = surface_->surface_;
    float limit = least.minCoeff();  // at first the disc that is nearest, then all that may be nearer
    const auto look_at = [&](int t) {
        const TrianglePoint p = closest_point(mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2), x);
        if (!nearer({t, p}, best)) return;
        best = {t, p};
        limit = static_cast<float>(p.square_distance + rounding_);
    };
    for (std::size_t f = 0; best.triangle < 0; ++f)
        for (int k = 0; k < 4 && best.triangle < 0; ++k)
            if (distances_[f][k] == limit) look_at(fours_[f].triangle[k]);
    const int first = best.triangle;
    for (std::size_t f = 0; f < count; ++f) {
        if (distances_[f].minCoeff() > limit) continue;
        for (int k = 0; k < 4; ++k)
            if (distances_[f][k] <= limit && fours_[f].triangle[k] != first) look_at(fours_[f].triangle[k]);
    }
    return best;
}

}  // namespace physics
