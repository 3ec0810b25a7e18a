#include "physics/geometry/embree_mesh.h"

#include <limits>
#include <stdexcept>

namespace geometry {

EmbreeMesh::EmbreeMesh(const TriangleMesh& mesh, const Vec3& middle, RTCSceneFlags more)
    : middle_(middle), device_(rtcNewDevice("threads=1")) {
    if (!device_) throw std::runtime_error("Embree could not be started");
    scene_ = rtcNewScene(device_);
    rtcSetSceneFlags(scene_, static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST | more));
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* v = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.vertices.size()));
    auto* t = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), mesh.triangles.size()));
    if (v && t) {
        for (const Vec3& p : mesh.vertices)
            for (int k = 0; k < 3; ++k) *v++ = static_cast<float>(p[k] - middle[k]);
        for (const auto& triangle : mesh.triangles)
            for (const int corner : triangle) *t++ = static_cast<unsigned>(corner);
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene_, geometry);
    }
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene_);
    if (v && t) return;
    release();
    throw std::runtime_error("Embree could not hold the mesh");
}

EmbreeMesh::~EmbreeMesh() {
    release();
}

void EmbreeMesh::release() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
}

RTCRayHit EmbreeMesh::cast(const Vec3& origin, const Vec3& direction, RayContext& context,
                           RTCFilterFunctionN filter, double start) const {
    const Vec3 local = origin - middle_;
    RTCRayHit ray{};
    ray.ray.org_x = static_cast<float>(local.x());
    ray.ray.org_y = static_cast<float>(local.y());
    ray.ray.org_z = static_cast<float>(local.z());
    ray.ray.dir_x = static_cast<float>(direction.x());
    ray.ray.dir_y = static_cast<float>(direction.y());
    ray.ray.dir_z = static_cast<float>(direction.z());
    ray.ray.tnear = static_cast<float>(start);
    ray.ray.tfar = std::numeric_limits<float>::infinity();
    ray.ray.mask = ~0u;
    ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
#if SELDINGER_EMBREE == 4
    rtcInitRayQueryContext(&context);
    RTCIntersectArguments arguments;
    rtcInitIntersectArguments(&arguments);
    arguments.context = &context;
    arguments.filter = filter;
    if (filter)
        arguments.flags =
            static_cast<RTCRayQueryFlags>(arguments.flags | RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER);
    rtcIntersect1(scene_, &ray, &arguments);
#else
    rtcInitIntersectContext(&context);
    context.filter = filter;
    rtcIntersect1(scene_, &context, &ray);
#endif
    return ray;
}

void EmbreeMesh::query(const Vec3& x, float radius, RTCPointQueryFunction visit, void* look) const {
    const Vec3 local = x - middle_;
    RTCPointQuery ball{};
    ball.x = static_cast<float>(local.x());
    ball.y = static_cast<float>(local.y());
    ball.z = static_cast<float>(local.z());
    ball.radius = radius;
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(scene_, &ball, &context, visit, look);
}

}  // namespace geometry
