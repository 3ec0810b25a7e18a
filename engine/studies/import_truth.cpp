#include "engine/studies/import_truth.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "physics/geometry/mesh_topology.h"

namespace studies {
namespace {

using geometry::CentrelineBranch;
using geometry::TriangleMesh;
using geometry::Vec3;

bool near_junction(const std::vector<CentrelineBranch>& branches, std::size_t own, std::size_t sample) {
    const Vec3& p = branches[own].points[sample];
    const double r = branches[own].radii[sample];
    for (std::size_t b = 0; b < branches.size(); ++b) {
        if (b == own) continue;
        for (std::size_t i = 0; i < branches[b].points.size(); ++i) {
            const double other = branches[b].radii[i];
            if ((branches[b].points[i] - p).norm() < r + other + 0.8 * std::min(r, other)) return true;
        }
    }
    return false;
}

bool near_end(const anatomy::Anatomy& anatomy, const Vec3& p) {
    return std::any_of(anatomy.ends.begin(), anatomy.ends.end(), [&](const anatomy::VesselEnd& end) {
        const Vec3 from = p - end.opening.centre;
        return from.norm() < 2 * end.opening.radius &&
               from.dot(end.opening.outward_normal) > -end.opening.radius;
    });
}

/// Number of branches in `wanted` with a branch of `given` that ends within 1.5 radii of their end.
int matched(const std::vector<CentrelineBranch>& wanted, const std::vector<CentrelineBranch>& given) {
    return static_cast<int>(std::count_if(wanted.begin(), wanted.end(), [&](const CentrelineBranch& branch) {
        return std::any_of(given.begin(), given.end(), [&](const CentrelineBranch& other) {
            return (branch.points.back() - other.points.back()).norm() < 1.5 * branch.radii.back();
        });
    }));
}

double at(const std::vector<double>& sorted, double part) {
    return sorted.empty() ? 0
                          : sorted[static_cast<std::size_t>(part * static_cast<double>(sorted.size() - 1))];
}

}  // namespace

TriangleMesh corrupted(const TriangleMesh& mesh, std::uint32_t seed) {
    std::mt19937 random(seed);
    const auto draw = [&] { return random() / 4294967296.0; };
    TriangleMesh result;
    for (const Vec3& v : mesh.vertices) {
        const double x = draw(), y = draw(), z = draw();
        result.vertices.push_back(v + 0.02 * (Vec3(x, y, z) - Vec3::Constant(0.5)));
    }
    for (auto t : mesh.triangles) {
        const double fate = draw();
        if (fate < 0.01) continue;
        if (fate < 0.06) std::swap(t[1], t[2]);
        result.triangles.push_back(t);
        if (fate < 0.99) continue;
        const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
        result.vertices.push_back((a + b) / 2 + 0.8 * (b - a).cross(c - a).normalized() * (b - a).norm());
        result.triangles.push_back({t[0], t[1], static_cast<int>(result.vertices.size()) - 1});
    }
    return result;
}

TriangleMesh flat_capped(const TriangleMesh& mesh) {
    TriangleMesh result = mesh;
    for (const geometry::BoundaryLoop& loop : geometry::topology(mesh).loops) {
        const int count = static_cast<int>(loop.vertices.size()),
                  first = static_cast<int>(result.vertices.size());
        const Vec3 centre = geometry::rim_centre(mesh, loop);
        for (const int v : loop.vertices) result.vertices.push_back((mesh.vertices[v] + centre) / 2);
        result.vertices.push_back(centre);
        for (int i = 0; i < count; ++i) {
            const int n = (i + 1) % count;
            result.triangles.push_back({loop.vertices[i], loop.vertices[n], first + i});
            result.triangles.push_back({loop.vertices[n], first + n, first + i});
            result.triangles.push_back({first + i, first + n, first + count});
        }
    }
    return result;
}

CentrelinePlace nearest_on(const std::vector<CentrelineBranch>& branches, const Vec3& p) {
    CentrelinePlace best{std::numeric_limits<double>::infinity(), 0};
    for (const CentrelineBranch& branch : branches) {
        for (std::size_t i = 0; i + 1 < branch.points.size(); ++i) {
            const Vec3 along = branch.points[i + 1] - branch.points[i];
            const double square = along.squaredNorm();
            const double part =
                square > 0 ? std::clamp((p - branch.points[i]).dot(along) / square, 0.0, 1.0) : 0;
            const double distance = (branch.points[i] + part * along - p).norm();
            if (distance < best.distance)
                best = {distance, (1 - part) * branch.radii[i] + part * branch.radii[i + 1]};
        }
    }
    return best;
}

ImportErrors import_errors(const anatomy::Anatomy& truth, const anatomy::Anatomy& found) {
    ImportErrors errors;
    errors.true_branches = static_cast<int>(truth.branches.size());
    errors.branches = matched(truth.branches, found.branches);
    errors.invented = static_cast<int>(found.branches.size()) - matched(found.branches, truth.branches);
    errors.true_ends = static_cast<int>(truth.ends.size());
    for (const anatomy::VesselEnd& end : truth.ends) {
        const geometry::OpenEnd& wanted = end.opening;
        const auto other = std::find_if(found.ends.begin(), found.ends.end(), [&](const auto& candidate) {
            return (candidate.opening.centre - wanted.centre).norm() < 0.5 * wanted.radius;
        });
        if (other == found.ends.end()) continue;
        ++errors.ends;
        const geometry::OpenEnd& own = other->opening;
        errors.end_centre = std::max(errors.end_centre, (own.centre - wanted.centre).norm());
        errors.end_radius = std::max(errors.end_radius, std::abs(own.radius / wanted.radius - 1));
        const double along = own.outward_normal.dot(wanted.outward_normal);
        errors.end_normal = std::max(errors.end_normal, std::acos(std::clamp(along, -1.0, 1.0)));
    }
    std::vector<double> centres, radii;
    for (std::size_t b = 0; b < truth.branches.size(); ++b) {
        const CentrelineBranch& branch = truth.branches[b];
        for (std::size_t i = 0; i < branch.points.size(); ++i) {
            if (near_end(truth, branch.points[i]) || near_junction(truth.branches, b, i)) continue;
            const CentrelinePlace place = nearest_on(found.branches, branch.points[i]);
            centres.push_back(place.distance);
            radii.push_back(std::abs(place.radius / branch.radii[i] - 1));
        }
    }
    std::sort(centres.begin(), centres.end());
    std::sort(radii.begin(), radii.end());
    errors.centre_p50 = at(centres, 0.5), errors.centre_p95 = at(centres, 0.95),
    errors.centre_max = at(centres, 1);
    errors.radius_p50 = at(radii, 0.5), errors.radius_p95 = at(radii, 0.95);
    return errors;
}

}  // namespace studies
