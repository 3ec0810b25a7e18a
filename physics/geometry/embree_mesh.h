#pragma once
/// A triangle mesh in Embree, version 3 or 4, for rays and closest points. For source files only: it includes
/// Embree's header, and nothing else knows which version it is.

#if SELDINGER_EMBREE == 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include "physics/geometry/vec.h"

namespace geometry {

#if SELDINGER_EMBREE == 4
using RayContext = RTCRayQueryContext;
inline constexpr RTCSceneFlags filtered_rays = RTC_SCENE_FLAG_FILTER_FUNCTION_IN_ARGUMENTS;
#else
using RayContext = RTCIntersectContext;
inline constexpr RTCSceneFlags filtered_rays = RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION;
#endif

/// Embree keeps corners in single precision: a query finds a triangle, whose place and plane are then taken
/// from the mesh's own corners.
class EmbreeMesh {
public:
    /// Coordinates are finest around `middle` [mm]. Throws std::runtime_error when Embree can't be started or
    /// can't hold the mesh.
    explicit EmbreeMesh(const TriangleMesh&, const Vec3& middle = Vec3::Zero(),
                        RTCSceneFlags more = RTC_SCENE_FLAG_NONE);
    ~EmbreeMesh();
    EmbreeMesh(const EmbreeMesh&) = delete;
    EmbreeMesh& operator=(const EmbreeMesh&) = delete;

    /// The first triangle along the unit direction, from `start` on [mm]; hits(…) reports whether there is
    /// one.
    RTCRayHit cast(const Vec3& origin, const Vec3& direction, double start = 0) const {
        RayContext context;
        return cast(origin, direction, context, nullptr, start);
    }
    /// The same of those triangles that `filter` lets pass; null lets all. It finds `context` in its
    /// arguments, which may be the base of a type of the caller's, and is initialised here. The mesh must
    /// have been made with `filtered_rays`.
    RTCRayHit cast(const Vec3& origin, const Vec3& direction, RayContext& context, RTCFilterFunctionN filter,
                   double start = 0) const;
    static bool hits(const RTCRayHit& ray) { return ray.hit.geomID != RTC_INVALID_GEOMETRY_ID; }

    /// Calls look(int triangle, float& radius) for triangles that may lie within the radius [mm]. `look`
    /// returns whether it has shortened the radius.
    template <class Look>
    void near(const Vec3& x, float radius, Look look) const {
        query(
            x, radius,
            [](RTCPointQueryFunctionArguments* at) {
                return (*static_cast<Look*>(at->userPtr))(static_cast<int>(at->primID), at->query->radius);
            },
            &look);
    }

private:
    void query(const Vec3&, float radius, RTCPointQueryFunction visit, void* look) const;
    void release();

    Vec3 middle_;
    RTCDevice device_;
    RTCScene scene_ = nullptr;
};

}  // namespace geometry
