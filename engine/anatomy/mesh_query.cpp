#include "engine/anatomy/mesh_query.h"

#include <cassert>
#include <cmath>
#include <embree3/rtcore.h>
#include <stdexcept>

#include "physics/lumen_surface.h"

namespace engine {

using physics::Vec3;

/// Corners relative to the middle of the mesh: Embree keeps single precision.
struct MeshQuery::Scene {
    explicit Scene(const physics::TriangleMesh& given) : mesh(given) {
        assert(!mesh.triangles.empty());
        Vec3 low = mesh.vertices[0], high = low;
        for (const Vec3& v : mesh.vertices) low = low.cwiseMin(v), high = high.cwiseMax(v);
        middle = (low + high) / 2;
        nudge = 1e-6 * (high - low).norm();
        device = rtcNewDevice("threads=1");
        if (!device) throw std::runtime_error("Embree could not be started");
        scene = rtcNewScene(device);
        rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
        RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
        auto* v = static_cast<float*>(rtcSetNewGeometryBuffer(
            geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.vertices.size()));
        auto* t = static_cast<unsigned*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0,
                                                                 RTC_FORMAT_UINT3, 3 * sizeof(unsigned),
                                                                 mesh.triangles.size()));
        if (v && t) {
            for (const Vec3& p : mesh.vertices)
                for (int k = 0; k < 3; ++k) *v++ = static_cast<float>(p[k] - middle[k]);
            for (const auto& triangle : mesh.triangles)
                for (int k = 0; k < 3; ++k) *t++ = static_cast<unsigned>(triangle[k]);
            rtcCommitGeometry(geometry);
            rtcAttachGeometry(scene, geometry);
        }
        rtcReleaseGeometry(geometry);
        rtcCommitScene(scene);
        if (!v || !t) {
            release();
            throw std::runtime_error("Embree could not hold the mesh");
        }
    }
    Scene(const Scene&) = delete;
    Scene& operator=(const Scene&) = delete;
    ~Scene() { release(); }
    void release() {
        rtcReleaseScene(scene);
        rtcReleaseDevice(device);
    }
    const Vec3& corner(unsigned triangle, int k) const { return mesh.vertices[mesh.triangles[triangle][k]]; }

    physics::TriangleMesh mesh;
    Vec3 middle;
    double nudge;  // longer than single precision's errors [mm]
    RTCDevice device = nullptr;
    RTCScene scene = nullptr;
};

namespace {

template <class Scene>
struct Search {
    const Scene* scene;
    Vec3 x;
    MeshQuery::Nearest best;

    static bool visit(RTCPointQueryFunctionArguments* arguments) {
        auto& search = *static_cast<Search*>(arguments->userPtr);
        const unsigned t = arguments->primID;
        const auto at = physics::closest_point(search.scene->corner(t, 0), search.scene->corner(t, 1),
                                               search.scene->corner(t, 2), search.x);
        const double distance = std::sqrt(at.square_distance);
        if (distance >= search.best.distance) return false;
        search.best = {static_cast<int>(t), distance};
        arguments->query->radius = static_cast<float>(distance + search.scene->nudge);
        return true;
    }
};

}  // namespace

MeshQuery::MeshQuery(const physics::TriangleMesh& mesh) : scene_(std::make_unique<Scene>(mesh)) {}
MeshQuery::MeshQuery(MeshQuery&&) noexcept = default;
MeshQuery::~MeshQuery() = default;

MeshQuery::Nearest MeshQuery::nearest(const Vec3& x, double within) const {
    Search<Scene> search{scene_.get(), x, {-1, within}};
    const Vec3 local = x - scene_->middle;
    RTCPointQuery query{};
    query.x = static_cast<float>(local.x());
    query.y = static_cast<float>(local.y());
    query.z = static_cast<float>(local.z());
    query.radius = static_cast<float>(within + scene_->nudge);
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(scene_->scene, &query, &context, &Search<Scene>::visit, &search);
    return search.best;
}

double MeshQuery::first_hit(const Vec3& origin, const Vec3& direction, double start) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    const Vec3 local = origin - scene_->middle;
    RTCRayHit hit{};
    hit.ray.org_x = static_cast<float>(local.x());
    hit.ray.org_y = static_cast<float>(local.y());
    hit.ray.org_z = static_cast<float>(local.z());
    hit.ray.dir_x = static_cast<float>(direction.x());
    hit.ray.dir_y = static_cast<float>(direction.y());
    hit.ray.dir_z = static_cast<float>(direction.z());
    hit.ray.tnear = static_cast<float>(start);
    hit.ray.tfar = std::numeric_limits<float>::infinity();
    hit.ray.mask = ~0u;
    hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene_->scene, &context, &hit);
    if (hit.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::numeric_limits<double>::infinity();
    return static_cast<double>(hit.ray.tfar);
}

int MeshQuery::crossings(const Vec3& origin, const Vec3& direction, int most) const {
    double start = 10 * scene_->nudge;
    for (int count = 0; count < most; ++count) {
        const double hit = first_hit(origin, direction, start);
        if (!std::isfinite(hit)) return count;
        start = hit + 10 * scene_->nudge;
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

}  // namespace engine
