#include "engine/studies/all_hits.h"

#include <Eigen/Geometry>
#include <utility>

#include "physics/geometry/embree_mesh.h"

namespace studies {

using geometry::TriangleMesh;
using geometry::Vec3;

struct AllHits::Scene {
    explicit Scene(TriangleMesh closed)
        : mesh(std::move(closed)), embree(mesh, Vec3::Zero(), geometry::filtered_rays) {}

    TriangleMesh mesh;
    geometry::EmbreeMesh embree;
};

AllHits::AllHits(TriangleMesh closed) : scene_(std::make_unique<const Scene>(std::move(closed))) {}
AllHits::~AllHits() = default;

namespace {

struct Trace : geometry::RayContext {
    const TriangleMesh* mesh;
    Vec3 origin, direction;
    AllHits::Sum sum;
};

void count(const RTCFilterFunctionNArguments* args) {
    auto& trace = *static_cast<Trace*>(args->context);
    const auto& corners = trace.mesh->triangles[reinterpret_cast<const RTCHit*>(args->hit)->primID];
    const Vec3& a = trace.mesh->vertices[corners[0]];
    const Vec3 normal = (trace.mesh->vertices[corners[1]] - a).cross(trace.mesh->vertices[corners[2]] - a);
    const double facing = normal.dot(trace.direction);
    if (facing != 0) {
        const double depth = normal.dot(a - trace.origin) / facing;
        trace.sum.length += facing > 0 ? depth : -depth;
        trace.sum.balance += facing > 0 ? -1 : 1;
    }
    args->valid[0] = 0;  // continue to the next hit
}

}  // namespace

AllHits::Sum AllHits::along(const Vec3& origin, const Vec3& direction) const {
    Trace trace;
    trace.mesh = &scene_->mesh;
    trace.origin = origin;
    trace.direction = direction;
    trace.sum = {};
    scene_->embree.cast(origin, direction, trace, count);
    return trace.sum;
}

}  // namespace studies
