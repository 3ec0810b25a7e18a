#pragma once
/// What physics/geometry/embree_mesh.h uses of Embree's interface, for browsers, which have no Embree: a tree
/// of boxes around the triangles, in single precision as Embree's. A query visits the same triangles in
/// another order and with other bounds, so that it finds the same nearest triangle; distances along rays
/// differ from Embree's in their last digits. Names are Embree's own (Embree 3, API reference).

#include <cstddef>
#include <cstdint>

// NOLINTBEGIN: names of another library
struct RTCTree;
using RTCDevice = int*;
using RTCScene = RTCTree*;
using RTCGeometry = RTCTree*;

enum RTCSceneFlags {
    RTC_SCENE_FLAG_NONE = 0,
    RTC_SCENE_FLAG_ROBUST = 4,
    RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION = 8
};
enum RTCGeometryType { RTC_GEOMETRY_TYPE_TRIANGLE };
enum RTCBufferType { RTC_BUFFER_TYPE_INDEX, RTC_BUFFER_TYPE_VERTEX };
enum RTCFormat { RTC_FORMAT_FLOAT3, RTC_FORMAT_UINT3 };
inline constexpr unsigned RTC_INVALID_GEOMETRY_ID = ~0u;

struct RTCRay {
    float org_x, org_y, org_z, tnear, dir_x, dir_y, dir_z, time, tfar;
    unsigned mask, id, flags;
};
struct RTCHit {
    float Ng_x, Ng_y, Ng_z, u, v;
    unsigned primID, geomID, instID[1];
};
struct RTCRayHit {
    RTCRay ray;
    RTCHit hit;
};
struct RTCFilterFunctionNArguments {
    int* valid;
    void* geometryUserPtr;
    const struct RTCIntersectContext* context;
    void* ray;
    void* hit;
    unsigned N;
};
using RTCFilterFunctionN = void (*)(const RTCFilterFunctionNArguments*);
struct RTCIntersectContext {
    RTCFilterFunctionN filter;
};
struct RTCPointQuery {
    float x, y, z, time, radius;
};
struct RTCPointQueryContext {};
struct RTCPointQueryFunctionArguments {
    RTCPointQuery* query;
    void* userPtr;
    unsigned primID, geomID;
};
using RTCPointQueryFunction = bool (*)(RTCPointQueryFunctionArguments*);

RTCDevice rtcNewDevice(const char*);
void rtcReleaseDevice(RTCDevice);
RTCScene rtcNewScene(RTCDevice);
void rtcSetSceneFlags(RTCScene, RTCSceneFlags);
void rtcReleaseScene(RTCScene);
RTCGeometry rtcNewGeometry(RTCDevice, RTCGeometryType);
void* rtcSetNewGeometryBuffer(RTCGeometry, RTCBufferType, unsigned slot, RTCFormat, std::size_t stride,
                              std::size_t count);
void rtcCommitGeometry(RTCGeometry);
unsigned rtcAttachGeometry(RTCScene, RTCGeometry);
void rtcReleaseGeometry(RTCGeometry);
void rtcCommitScene(RTCScene);
void rtcInitIntersectContext(RTCIntersectContext*);
void rtcIntersect1(RTCScene, RTCIntersectContext*, RTCRayHit*);
void rtcInitPointQueryContext(RTCPointQueryContext*);
bool rtcPointQuery(RTCScene, RTCPointQuery*, RTCPointQueryContext*, RTCPointQueryFunction, void* user);
// NOLINTEND
