#include "physics/geometry/mesh_query.h"

#include <cassert>
#include <cmath>

#include "physics/geometry/embree_mesh.h"
#include "physics/geometry/lumen_surface.h"

namespace geometry {

struct MeshQuery::Scene {
    explicit Scene(const TriangleMesh& given) : Scene(given, box_of(given)) {}
    const Vec3& corner(int triangle, int k) const { return mesh.vertices[mesh.triangles[triangle][k]]; }

    TriangleMesh mesh;
    double nudge;  // longer than single precision's errors [mm]
    EmbreeMesh embree;

private:
    static Eigen::AlignedBox3d box_of(const TriangleMesh& mesh) {
        assert(!mesh.triangles.empty());
        Eigen::AlignedBox3d box;
        for (const Vec3& v : mesh.vertices) box.extend(v);
        return box;
    }
    Scene(const TriangleMesh& given, const Eigen::AlignedBox3d& box)
        : mesh(given), nudge(1e-6 * box.diagonal().norm()), embree(mesh, box.center()) {}
};

MeshQuery::MeshQuery(const TriangleMesh& mesh) : scene_(std::make_unique<Scene>(mesh)) {}
MeshQuery::MeshQuery(MeshQuery&&) noexcept = default;
MeshQuery::~MeshQuery() = default;

MeshQuery::Nearest MeshQuery::nearest(const Vec3& x, double within) const {
    Nearest best{-1, within};
    const auto look = [&](int t, float& radius) {
        const double square =
            closest_point(scene_->corner(t, 0), scene_->corner(t, 1), scene_->corner(t, 2), x)
                .square_distance;
        const double distance = std::sqrt(square);
        if (distance >= best.distance) return false;
        best = {t, distance};
        radius = static_cast<float>(distance + scene_->nudge);
        return true;
    };
    scene_->embree.near(x, static_cast<float>(within + scene_->nudge), look);
    return best;
}

MeshQuery::Hit MeshQuery::hit(const Vec3& origin, const Vec3& direction, double start) const {
    const RTCRayHit ray = scene_->embree.cast(origin, direction, start);
    if (!EmbreeMesh::hits(ray)) return {};
    return {static_cast<double>(ray.ray.tfar), Vec3(ray.hit.Ng_x, ray.hit.Ng_y, ray.hit.Ng_z).normalized()};
}

double MeshQuery::nudge() const {
    return 10 * scene_->nudge;
}

int MeshQuery::crossings(const Vec3& origin, const Vec3& direction, int most) const {
    double start = nudge();
    for (int count = 0; count < most; ++count) {
        const double hit = first_hit(origin, direction, start);
        if (!std::isfinite(hit)) return count;
        start = hit + nudge();
    }
    return most;
}

bool MeshQuery::encloses(const Vec3& x) const {
    int votes = 0;
    for (const Vec3& direction : {Vec3(0.267261, 0.534522, 0.801784), Vec3(-0.824163, 0.549442, 0.137361),
                                  Vec3(0.371391, -0.742781, 0.557086)})
        votes += crossings(x, direction, 64) % 2;
    return votes >= 2;
}

}  // namespace geometry
