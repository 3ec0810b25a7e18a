#include "engine/studies/all_hits.h"

#include <Eigen/Geometry>
#include <embree3/rtcore.h>
#include <limits>
#include <utility>

namespace engine {

using physics::TriangleMesh;
using physics::Vec3;

struct AllHits::Scene {
    TriangleMesh mesh;
    RTCDevice device;
    RTCScene scene;

    explicit Scene(TriangleMesh closed)
        : mesh(std::move(closed)), device(rtcNewDevice("threads=1")), scene(rtcNewScene(device)) {
        rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
        RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
        auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
            geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.vertices.size()));
        for (const Vec3& v : mesh.vertices)
            for (int k = 0; k < 3; ++k) *vertices++ = static_cast<float>(v[k]);
        auto* indices = static_cast<unsigned*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0,
                                                                       RTC_FORMAT_UINT3, 3 * sizeof(unsigned),
                                                                       mesh.triangles.size()));
        for (const auto& triangle : mesh.triangles)
            for (const int corner : triangle) *indices++ = static_cast<unsigned>(corner);
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene, geometry);
        rtcReleaseGeometry(geometry);
        rtcCommitScene(scene);
    }
    ~Scene() {
        rtcReleaseScene(scene);
        rtcReleaseDevice(device);
    }
    Scene(const Scene&) = delete;
    Scene& operator=(const Scene&) = delete;
};

AllHits::AllHits(TriangleMesh closed) : scene_(std::make_unique<const Scene>(std::move(closed))) {}
AllHits::~AllHits() = default;
AllHits::AllHits(AllHits&&) noexcept = default;

namespace {

struct Trace : RTCIntersectContext {
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
    args->valid[0] = 0;  // and on to the next
}

}  // namespace

AllHits::Sum AllHits::along(const Vec3& origin, const Vec3& direction) const {
    Trace trace;
    rtcInitIntersectContext(&trace);
    trace.filter = count;
    trace.mesh = &scene_->mesh;
    trace.origin = origin;
    trace.direction = direction;
    trace.sum = {};
    RTCRayHit ray{};
    ray.ray.org_x = static_cast<float>(origin.x());
    ray.ray.org_y = static_cast<float>(origin.y());
    ray.ray.org_z = static_cast<float>(origin.z());
    ray.ray.dir_x = static_cast<float>(direction.x());
    ray.ray.dir_y = static_cast<float>(direction.y());
    ray.ray.dir_z = static_cast<float>(direction.z());
    ray.ray.tfar = std::numeric_limits<float>::infinity();
    ray.ray.mask = ~0u;
    ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene_->scene, &trace, &ray);
    return trace.sum;
}

}  // namespace engine
