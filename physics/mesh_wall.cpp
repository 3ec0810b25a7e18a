#include "physics/mesh_wall.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <embree3/rtcore.h>
#include <limits>
#include <stdexcept>

namespace physics {
namespace {

/// A joint deeper inside than this share of the local radius asks no ray: it touches nothing.
constexpr double kNearWall = 0.35;
/// Centrelines and radii of a mesh are known to about this much [mm]; taken off every promise of clearance.
constexpr double kCentrelineError = 0.1;

struct Station {
    Vec3 centre;
    double radius;
    int branch, sample;
};

/// Signed square distance to the ball at a station: least for the ball that holds the point deepest.
double power(const Station& s, const Vec3& x) {
    return (x - s.centre).squaredNorm() - s.radius * s.radius;
}

}  // namespace

struct MeshWall::Scene {
    TriangleMesh mesh;
    std::vector<OpenEnd> ends;
    double stiffness, wire_radius;
    std::vector<Station> stations;
    std::vector<std::vector<int>> neighbours;  // along a branch and across junctions
    RTCDevice device = nullptr;
    RTCScene scene = nullptr;

    ~Scene() {
        if (scene) rtcReleaseScene(scene);
        if (device) rtcReleaseDevice(device);
    }
    void build_stations(const std::vector<CentrelineBranch>&);
    void build_embree();
    int locate(const Vec3& x, int hint) const;
    bool beyond_an_end(const Vec3& x) const;
    Vec3 ray_origin(int station, const Vec3& x) const;
    WallContact contact(const Vec3& x, int hint) const;
};

MeshWall::MeshWall(const TriangleMesh& lumen, std::vector<CentrelineBranch> branches,
                   std::vector<OpenEnd> ends, double stiffness, double wire_radius) {
    if (lumen.triangles.empty()) throw std::invalid_argument("the lumen mesh has no triangles");
    for (const Vec3& v : lumen.vertices)
        if (!v.allFinite()) throw std::invalid_argument("the lumen mesh has a vertex that is not finite");
    for (const auto& t : lumen.triangles)
        for (int v : t)
            if (v < 0 || v >= static_cast<int>(lumen.vertices.size()))
                throw std::invalid_argument("the lumen mesh has a triangle with an index out of range");
    if (!std::isfinite(stiffness) || stiffness <= 0)
        throw std::invalid_argument("wall stiffness must be > 0");
    auto scene = std::make_unique<Scene>();
    scene->mesh = lumen;
    scene->ends = std::move(ends);
    scene->stiffness = stiffness;
    scene->wire_radius = wire_radius;
    scene->build_stations(branches);
    scene->build_embree();
    scene_ = std::move(scene);
}

MeshWall::~MeshWall() = default;

void MeshWall::Scene::build_stations(const std::vector<CentrelineBranch>& branches) {
    std::vector<int> first;
    for (std::size_t b = 0; b < branches.size(); ++b) {
        const CentrelineBranch& branch = branches[b];
        if (branch.points.size() < 2 || branch.radii.size() != branch.points.size())
            throw std::invalid_argument("branch '" + branch.name +
                                        "' needs two points or more, a radius for each");
        first.push_back(static_cast<int>(stations.size()));
        for (std::size_t i = 0; i < branch.points.size(); ++i) {
            if (!branch.points[i].allFinite() || !std::isfinite(branch.radii[i]) || branch.radii[i] <= 0)
                throw std::invalid_argument("branch '" + branch.name + "', sample " + std::to_string(i) +
                                            ": the point must be finite and the radius positive");
            stations.push_back({branch.points[i], branch.radii[i], static_cast<int>(b), static_cast<int>(i)});
        }
    }
    if (stations.empty()) throw std::invalid_argument("the lumen has no centreline");

    neighbours.resize(stations.size());
    auto link = [&](int a, int b) {
        if (std::find(neighbours[a].begin(), neighbours[a].end(), b) == neighbours[a].end()) {
            neighbours[a].push_back(b);
            neighbours[b].push_back(a);
        }
    };
    for (std::size_t s = 0; s + 1 < stations.size(); ++s)
        if (stations[s].branch == stations[s + 1].branch) link(s, s + 1);
    // A child lies inside its parent for its first samples: there each links to the parent's stations around
    // it, so that a joint finds its way through the ostium in both directions.
    for (std::size_t b = 0; b < branches.size(); ++b) {
        const int parent = branches[b].parent;
        if (parent < 0) continue;
        if (parent >= static_cast<int>(branches.size()))
            throw std::invalid_argument("branch '" + branches[b].name + "' has a parent that does not exist");
        const int p0 = first[parent], p1 = p0 + static_cast<int>(branches[parent].points.size());
        for (std::size_t i = 0; i < branches[b].points.size(); ++i) {
            const int child = first[b] + static_cast<int>(i);
            int nearest = p0;
            for (int p = p0; p < p1; ++p)
                if (power(stations[p], stations[child].centre) <
                    power(stations[nearest], stations[child].centre))
                    nearest = p;
            const double gap = (stations[nearest].centre - stations[child].centre).norm() -
                               stations[nearest].radius - stations[child].radius;
            if (gap > 0) break;
            for (int p = std::max(p0, nearest - 3); p <= std::min(p1 - 1, nearest + 3); ++p) link(child, p);
        }
    }
}

void MeshWall::Scene::build_embree() {
    device = rtcNewDevice("threads=1");
    if (!device) throw std::runtime_error("Embree could not be started");
    scene = rtcNewScene(device);
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* v = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.vertices.size()));
    auto* t = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), mesh.triangles.size()));
    if (!v || !t) {
        rtcReleaseGeometry(geometry);
        throw std::runtime_error("Embree could not hold the lumen mesh");
    }
    for (const Vec3& p : mesh.vertices)
        for (int k = 0; k < 3; ++k) *v++ = static_cast<float>(p[k]);
    for (const auto& tri : mesh.triangles)
        for (int k = 0; k < 3; ++k) *t++ = static_cast<unsigned>(tri[k]);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene);
}

int MeshWall::Scene::locate(const Vec3& x, int hint) const {
    const int count = static_cast<int>(stations.size());
    if (hint < 0 || hint >= count) {
        int best = 0;
        for (int s = 1; s < count; ++s)
            if (power(stations[s], x) < power(stations[best], x)) best = s;
        return best;
    }
    int best = hint;
    double least = power(stations[best], x);
    for (bool moved = true; moved;) {
        moved = false;
        const int from = best;
        for (int s : neighbours[from])
            if (const double p = power(stations[s], x); p < least) least = p, best = s, moved = true;
    }
    return best;
}

bool MeshWall::Scene::beyond_an_end(const Vec3& x) const {
    for (const OpenEnd& end : ends) {
        const Vec3 d = x - end.centre;
        const double out = d.dot(end.outward_normal);
        if (out > 0 && (d - out * end.outward_normal).squaredNorm() < 4 * end.radius * end.radius &&
            out < 4 * end.radius)
            return true;
    }
    return false;
}

/// Closest point of the centreline to x near a station; the ray then meets the wall about at a right angle.
Vec3 MeshWall::Scene::ray_origin(int s, const Vec3& x) const {
    Vec3 best = stations[s].centre;
    double least = (x - best).squaredNorm();
    for (int other : {s - 1, s + 1}) {
        if (other < 0 || other >= static_cast<int>(stations.size())) continue;
        if (stations[other].branch != stations[s].branch) continue;
        const Vec3 a = stations[s].centre, ab = stations[other].centre - a;
        const Vec3 c = a + std::clamp((x - a).dot(ab) / ab.squaredNorm(), 0.0, 1.0) * ab;
        if (const double d = (x - c).squaredNorm(); d < least) least = d, best = c;
    }
    return best;
}

WallContact MeshWall::Scene::contact(const Vec3& x, int hint) const {
    WallContact c;
    c.station = locate(x, hint);
    c.stiffness = stiffness;
    const Station& station = stations[c.station];
    const double inside = station.radius - (x - station.centre).norm() - wire_radius;
    c.room = station.radius - wire_radius;
    c.penetration = -std::max(inside, 1e-3);
    c.trust = std::max(0.0, inside - kCentrelineError);
    if (inside > kNearWall * station.radius) return c;

    const Vec3 origin = ray_origin(c.station, x);
    const Vec3 out = x - origin;
    const double distance = out.norm();
    if (distance < 1e-9 || beyond_an_end(x)) return c;
    const Vec3 way = out / distance;

    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRayHit hit{};
    hit.ray.org_x = static_cast<float>(origin.x());
    hit.ray.org_y = static_cast<float>(origin.y());
    hit.ray.org_z = static_cast<float>(origin.z());
    hit.ray.dir_x = static_cast<float>(way.x());
    hit.ray.dir_y = static_cast<float>(way.y());
    hit.ray.dir_z = static_cast<float>(way.z());
    hit.ray.tfar = std::numeric_limits<float>::infinity();
    hit.ray.mask = ~0u;
    hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene, &context, &hit);
    if (hit.hit.geomID == RTC_INVALID_GEOMETRY_ID) return c;  // out through an open end

    const auto& triangle = mesh.triangles[hit.hit.primID];
    const Vec3 &p = mesh.vertices[triangle[0]], &q = mesh.vertices[triangle[1]],
               &r = mesh.vertices[triangle[2]];
    Vec3 normal = (q - p).cross(r - p).normalized();
    if (normal.dot(way) < 0) normal = -normal;
    c.normal = normal;
    c.penetration = normal.dot(x - p) + wire_radius;
    return c;
}

void MeshWall::contacts(std::span<const Vec3> joints, std::span<WallContact> contacts) const {
    for (std::size_t i = 0; i < joints.size(); ++i)
        contacts[i] = scene_->contact(joints[i], contacts[i].station);
}

MeshWall::Place MeshWall::place(int station) const {
    if (station < 0 || station >= static_cast<int>(scene_->stations.size())) return {};
    return {scene_->stations[station].branch, scene_->stations[station].sample};
}

}  // namespace physics
