#include "physics/wall/mesh_wall.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "physics/geometry/embree_mesh.h"
#include "physics/geometry/mesh_topology.h"
#include "physics/wall/even_rims.h"
#include "physics/wall/past_end.h"

namespace physics {
namespace {

/// A joint deeper inside than this fraction of the local radius casts no ray: it touches nothing.
constexpr double near_wall = 0.35;

}  // namespace

struct MeshWall::Scene {
    CentrelineTree tree;
    TriangleMesh mesh;
    WallStiffness stiffness;
    double wire_radius;
    EmbreeMesh embree;
    std::vector<ContinuedEnd> ends = continued_ends(tree.ends());

    Scene(const TriangleMesh& lumen, CentrelineTree centrelines, WallStiffness k, double radius)
        : tree(std::move(centrelines)),
          mesh(with_even_rims(welded(lumen), tree.ends())),
          stiffness(std::move(k)),
          wire_radius(radius),
          embree(mesh) {}
    WallContact contact(const Vec3& x, int hint, double thickness) const;
};

MeshWall::MeshWall(const TriangleMesh& lumen, std::vector<CentrelineBranch> branches,
                   std::vector<OpenEnd> ends, WallStiffness stiffness, double wire_radius) {
    if (lumen.triangles.empty()) throw std::invalid_argument("the lumen mesh has no triangles");
    for (const Vec3& v : lumen.vertices)
        if (!v.allFinite()) throw std::invalid_argument("the lumen mesh has a vertex that is not finite");
    for (const auto& t : lumen.triangles)
        for (int v : t)
            if (v < 0 || v >= static_cast<int>(lumen.vertices.size()))
                throw std::invalid_argument("the lumen mesh has a triangle with an index out of range");
    scene_ = std::make_unique<const Scene>(lumen, CentrelineTree(branches, std::move(ends)),
                                           std::move(stiffness), wire_radius);
}

MeshWall::~MeshWall() = default;

WallContact MeshWall::Scene::contact(const Vec3& x, int hint, double thickness) const {
    WallContact c;
    const double joint = wire_radius + thickness;
    c.thickness = thickness;
    c.station = tree.locate(x, hint);
    c.stiffness = stiffness.mean();
    const Station& station = tree.stations()[c.station];
    const double inside = station.radius - (x - station.centre).norm() - joint;
    c.clearance = station.radius - joint;
    c.penetration = -std::max(inside, 1e-3);
    c.trust = std::max(0.0, inside - centreline_error);
    const PastEnd past(x, ends, tree.ends_at(c.station), 0);
    if (!past.inside()) {
        past.apply(x, joint, joint, c);
        past.part_cusps(x, joint, stiffness.joint_length(), c);
        return c;
    }
    past.limit(x, joint, c);
    if (inside > near_wall * station.radius) return c;

    // From the closest point of the centreline the ray meets the wall about at a right angle.
    const Vec3 origin = tree.closest_point(c.station, x);
    const Vec3 out = x - origin;
    const double distance = out.norm();
    if (distance < 1e-9) return c;
    const Vec3 direction = out / distance;

    const RTCRayHit ray = embree.cast(origin, direction);
    if (!EmbreeMesh::hits(ray)) return c;  // out through an open end

    const auto& triangle = mesh.triangles[ray.hit.primID];
    const Vec3 &p = mesh.vertices[triangle[0]], &q = mesh.vertices[triangle[1]],
               &r = mesh.vertices[triangle[2]];
    Vec3 normal = (q - p).cross(r - p).normalized();
    if (normal.dot(direction) < 0) normal = -normal;
    c.normal = normal;
    c.penetration = normal.dot(x - p) + joint;
    if (!stiffness.uniform()) stiffness.apply(tree.coordinate(c.station, x), c);
    return c;
}

bool MeshWall::same_vessel(int station, int other) const {
    return scene_->tree.same_branch(station, other);
}

void MeshWall::apply_stiffness(const Vec3& x, WallContact& c) const {
    if (!scene_->stiffness.uniform()) scene_->stiffness.apply(scene_->tree.coordinate(c.station, x), c);
}

void MeshWall::rigid_contacts(std::span<const Vec3> joints, std::span<WallContact> contacts) const {
    require_finite(joints);
    for (std::size_t i = 0; i < joints.size(); ++i)
        contacts[i] = scene_->contact(joints[i], contacts[i].station, contacts[i].thickness);
}

MeshWall::Place MeshWall::place(int station) const {
    const auto stations = scene_->tree.stations();
    if (station < 0 || station >= static_cast<int>(stations.size())) return {};
    return {stations[station].branch, stations[station].sample};
}

}  // namespace physics
