#include "physics/geometry/seen_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "physics/geometry/embree_mesh.h"

namespace geometry {
namespace {

/// Covers the rounding of square distances to discs in double precision: a fraction of them, and [mm²].
constexpr double box_rounding = 1e-9;
/// Corners may be this far from the plane of a disc [mm].
constexpr double flat = 1e-7;

/// Among triangles that meet in the closest point the first counts, whichever way the search came.
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
    const double height = d.dot(normal), least = std::max(0.0, std::abs(height) - flat);
    const double beside = std::max(0.0, std::sqrt(std::max(0.0, d.squaredNorm() - height * height)) - radius);
    return least * least + beside * beside;
}

SeenSurface::SeenSurface(const LumenSurface& surface)
    : surface_(surface), scene_(new Scene{EmbreeMesh(surface.mesh())}) {
    for (int t = 0; t < surface.count(); ++t) {
        const LumenSurface::Sphere& sphere = surface.sphere(t);
        Disc disc{sphere.centre, surface.area_normal(t).normalized(), sphere.radius + flat};
        for (int k = 0; k < 3; ++k) {
            const double off = std::abs(disc.normal.dot(surface.corner(t, k) - disc.centre));
            if (!(off < flat)) disc.normal = Vec3::Zero();
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
        // Discs reject most of the triangles that Embree's boxes let pass.
        if (surface.discs_[t].square_distance(x) > best_square() * (1 + box_rounding) + box_rounding)
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
};

NearestTriangle SeenSurface::nearest(const Vec3& x, int seed, const SeenStations& seen) const {
    Search search{*this, seen, x};
    float radius = std::numeric_limits<float>::infinity();
    if (seed >= 0 && search.look_at(seed)) radius = search.radius();
    scene_->embree.near(x, radius, [&](int t, float& within) {
        if (!search.look_at(t)) return false;
        within = std::min(within, search.radius());
        return true;
    });
    return search.best;
}

template <class Put>
void SeenSurface::Patch::take(const Vec3& middle, const NearestTriangle& nearest, const Put& put) {
    middle_ = middle;
    middle_triangle_ = nearest.triangle;
    // Sorted as finely as the queries need: by steps of the square distance.
    constexpr int step_count = 8;
    const auto first = static_cast<float>(nearest.at.square_distance), last = static_cast<float>(far_ * far_);
    const float step = (last - first) / step_count + 1e-30f;
    const auto step_of = [&](const Candidate& c) {
        return std::clamp(static_cast<int>((c.square - first) / step), 0, step_count - 1);
    };
    int next[step_count + 1] = {};
    for (const Candidate& c : candidates_) ++next[step_of(c) + 1];
    for (int k = 0; k < step_count; ++k) next[k + 1] += next[k];
    const int count = static_cast<int>(candidates_.size());
    lanes_.resize((count + lane_count - 1) / lane_count);
    square_.assign(lanes_.size(), 0);
    for (std::size_t at = count; at < lane_count * lanes_.size(); ++at) {
        Lanes& lanes = lanes_[at / lane_count];
        const std::size_t k = at % lane_count;
        lanes.x[k] = 1e15f;  // never near
        for (auto column :
             {&Lanes::y, &Lanes::z, &Lanes::normal_x, &Lanes::normal_y, &Lanes::normal_z, &Lanes::radius})
            (lanes.*column)[k] = 0;
    }
    for (const Candidate& c : candidates_) {
        const int k = step_of(c), at = next[k]++;
        if (at % lane_count == 0 && k > 0) square_[at / lane_count] = first + static_cast<float>(k) * step;
        put(c.which, lanes_[at / lane_count], at % lane_count);
    }
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
    candidates_.clear();
    if (middle.triangle >= 0) {
        const double square_reach = far_ * far_ + rounding_;
        surface.scene_->embree.near(centre, static_cast<float>(1.0001 * far_ + 1e-3), [&](int t, float&) {
            if (!seen(t)) return false;
            const double square = surface.discs_[t].square_distance(centre);
            if (square <= square_reach) candidates_.push_back({static_cast<float>(square), t});
            return false;
        });
    }
    take(centre, middle, [&](int triangle, Lanes& to, int at) {
        const Disc& disc = surface.discs_[triangle];
        const Eigen::Vector3f from = (disc.centre - centre_).cast<float>(),
                              normal = disc.normal.cast<float>();
        to.x[at] = from.x(), to.y[at] = from.y(), to.z[at] = from.z();
        to.normal_x[at] = normal.x(), to.normal_y[at] = normal.y(), to.normal_z[at] = normal.z();
        to.radius[at] = static_cast<float>(disc.radius);
        to.triangle[at] = triangle;
    });
}

void SeenSurface::Patch::gather(const Patch& whole, const Vec3& middle, double reach) {
    surface_ = whole.surface_;
    centre_ = whole.centre_;
    rounding_ = whole.rounding_;
    const NearestTriangle nearest = whole.nearest(middle, 2 * reach);
    far_ = std::sqrt(nearest.at.square_distance) + 2 * reach;
    const auto limit = static_cast<float>(far_ * far_ + rounding_);
    candidates_.clear();
    for (int n = 0; n < static_cast<int>(whole.distances_.size()); ++n) {
        const Lanes::Column& square = whole.distances_[n];
        if (square.minCoeff() > limit) continue;
        for (int k = 0; k < lane_count; ++k)
            if (square[k] <= limit) candidates_.push_back({square[k], lane_count * n + k});
    }
    take(middle, nearest, [&](int which, Lanes& to, int at) {
        const Lanes& from = whole.lanes_[which / lane_count];
        const int k = which % lane_count;
        to.x[at] = from.x[k], to.y[at] = from.y[k], to.z[at] = from.z[k];
        to.normal_x[at] = from.normal_x[k], to.normal_y[at] = from.normal_y[k];
        to.normal_z[at] = from.normal_z[k], to.radius[at] = from.radius[k];
        to.triangle[at] = from.triangle[k];
    });
}

NearestTriangle SeenSurface::Patch::nearest(const Vec3& x, double more) const {
    const Eigen::Vector3f from = (x - centre_).cast<float>();
    const double reach = (x - middle_).norm() + more;
    const LumenSurface& mesh = surface_->surface_;
    NearestTriangle best;
    float limit = 0, from_middle = 0;  // of square distances to discs
    const auto look_at = [&](int t) {
        const TrianglePoint p = closest_point(mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2), x);
        if (!nearer({t, p}, best)) return;
        best = {t, p};
        limit = static_cast<float>(p.square_distance + rounding_);
        const double most = std::sqrt(p.square_distance) + reach;
        from_middle = static_cast<float>(most * most + 2 * rounding_);
    };
    look_at(middle_triangle_);
    distances_.resize(lanes_.size());
    std::size_t n = 0;
    for (; n < lanes_.size() && square_[n] <= from_middle; ++n) {
        const Lanes::Column square = lanes_[n].square_distances(from);
        distances_[n] = square;
        if (square.minCoeff() > limit) continue;
        for (int k = 0; k < lane_count; ++k)
            if (square[k] <= limit && lanes_[n].triangle[k] != middle_triangle_)
                look_at(lanes_[n].triangle[k]);
    }
    distances_.resize(n);
    return best;
}

}  // namespace geometry
