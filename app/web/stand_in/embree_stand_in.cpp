#include <algorithm>
#include <array>
#include <cmath>
#include <embree3/rtcore.h>
#include <limits>
#include <memory>
#include <numeric>
#include <vector>

namespace {

using Corner = std::array<float, 3>;

struct Box {
    Corner low, high;
    void clear() {
        low.fill(std::numeric_limits<float>::infinity());
        high.fill(-std::numeric_limits<float>::infinity());
    }
    void extend(const Corner& p) {
        for (std::size_t k = 0; k < 3; ++k)
            low[k] = std::min(low[k], p[k]), high[k] = std::max(high[k], p[k]);
    }
    /// Of a point to the box.
    float square_distance(const Corner& p) const {
        float sum = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            const float d = std::max({low[k] - p[k], 0.0f, p[k] - high[k]});
            sum += d * d;
        }
        return sum;
    }
};

constexpr int leaf_size = 4, deepest = 64;

}  // namespace

/// A scene of one mesh, and the mesh on its way into it.
struct RTCTree {
    struct Node {
        Box box;
        int first = 0, count = 0;  // triangles of a leaf
        int right = 0;             // the other child; the first follows its parent
    };
    std::vector<Corner> corners;
    std::vector<std::array<unsigned, 3>> triangles;
    std::vector<unsigned> order;
    std::vector<Node> nodes;

    const Corner& corner(unsigned triangle, std::size_t k) const { return corners[triangles[triangle][k]]; }

    void build() {
        order.resize(triangles.size());
        std::iota(order.begin(), order.end(), 0u);
        std::vector<Corner> middles;
        middles.reserve(triangles.size());
        for (const auto& t : triangles) {
            Corner middle{};
            for (std::size_t k = 0; k < 3; ++k)
                middle[k] = (corners[t[0]][k] + corners[t[1]][k] + corners[t[2]][k]) / 3;
            middles.push_back(middle);
        }
        nodes.clear();
        nodes.reserve(2 * triangles.size() / leaf_size + 2);
        if (!triangles.empty()) split(0, static_cast<int>(triangles.size()), middles);
    }

    void split(int first, int count, const std::vector<Corner>& middles) {
        const auto at = nodes.size();
        nodes.emplace_back();
        Box box, of_middles;
        box.clear(), of_middles.clear();
        for (int k = first; k < first + count; ++k) {
            const unsigned t = order[static_cast<std::size_t>(k)];
            for (std::size_t c = 0; c < 3; ++c) box.extend(corner(t, c));
            of_middles.extend(middles[t]);
        }
        nodes[at].box = box;
        if (count <= leaf_size) {
            nodes[at].first = first, nodes[at].count = count;
            return;
        }
        std::size_t axis = 0;
        for (std::size_t k = 1; k < 3; ++k)
            if (of_middles.high[k] - of_middles.low[k] > of_middles.high[axis] - of_middles.low[axis])
                axis = k;
        const auto begin = order.begin() + first;
        std::nth_element(begin, begin + count / 2, begin + count, [&](unsigned a, unsigned b) {
            return middles[a][axis] < middles[b][axis] || (middles[a][axis] == middles[b][axis] && a < b);
        });
        split(first, count / 2, middles);
        nodes[at].right = static_cast<int>(nodes.size());
        split(first + count / 2, count - count / 2, middles);
    }
};

RTCDevice rtcNewDevice(const char*) {
    static int device = 0;
    return &device;
}
void rtcReleaseDevice(RTCDevice) {}
RTCScene rtcNewScene(RTCDevice) {
    return new RTCTree;
}
void rtcSetSceneFlags(RTCScene, RTCSceneFlags) {}
void rtcReleaseScene(RTCScene scene) {
    delete scene;
}
RTCGeometry rtcNewGeometry(RTCDevice, RTCGeometryType) {
    return new RTCTree;
}
void* rtcSetNewGeometryBuffer(RTCGeometry mesh, RTCBufferType type, unsigned, RTCFormat, std::size_t,
                              std::size_t count) {
    if (type == RTC_BUFFER_TYPE_VERTEX) {
        mesh->corners.resize(count);
        return mesh->corners.data();
    }
    mesh->triangles.resize(count);
    return mesh->triangles.data();
}
void rtcCommitGeometry(RTCGeometry) {}
unsigned rtcAttachGeometry(RTCScene scene, RTCGeometry mesh) {
    scene->corners = mesh->corners;
    scene->triangles = mesh->triangles;
    return 0;
}
void rtcReleaseGeometry(RTCGeometry mesh) {
    delete mesh;
}
void rtcCommitScene(RTCScene scene) {
    scene->build();
}
void rtcInitIntersectContext(RTCIntersectContext* context) {
    *context = {};
}
void rtcInitPointQueryContext(RTCPointQueryContext*) {}

void rtcIntersect1(RTCScene scene, RTCIntersectContext* context, RTCRayHit* hit) {
    RTCRay& ray = hit->ray;
    const Corner from{ray.org_x, ray.org_y, ray.org_z}, way{ray.dir_x, ray.dir_y, ray.dir_z};
    // A little more than the box, as a ray in the plane of a side must not miss it.
    const auto reaches = [&](const Box& box) {
        float enter = ray.tnear, leave = ray.tfar;
        for (std::size_t k = 0; k < 3; ++k) {
            if (way[k] == 0) {
                if (from[k] < box.low[k] || from[k] > box.high[k]) return false;
                continue;
            }
            float a = (box.low[k] - from[k]) / way[k], b = (box.high[k] - from[k]) / way[k];
            if (a > b) std::swap(a, b);
            enter = std::max(enter, a - 4e-7f * std::abs(a));
            leave = std::min(leave, b + 4e-7f * std::abs(b));
        }
        return enter <= leave;
    };
    const auto look_at = [&](unsigned t) {
        // Möller and Trumbore (1997), in double precision.
        const auto along = [](const Corner& a, const Corner& b) {
            return std::array<double, 3>{double(b[0]) - a[0], double(b[1]) - a[1], double(b[2]) - a[2]};
        };
        const auto cross = [](const auto& a, const auto& b) {
            return std::array<double, 3>{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                                         a[0] * b[1] - a[1] * b[0]};
        };
        const auto dot = [](const auto& a, const auto& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
        const std::array<double, 3> d{way[0], way[1], way[2]};
        const auto e1 = along(scene->corner(t, 0), scene->corner(t, 1));
        const auto e2 = along(scene->corner(t, 0), scene->corner(t, 2));
        const auto s = along(scene->corner(t, 0), from);
        const auto p = cross(d, e2);
        const double determinant = dot(e1, p);
        if (determinant == 0) return;
        const double u = dot(s, p) / determinant;
        const auto q = cross(s, e1);
        const double v = dot(d, q) / determinant;
        if (!(u >= 0 && v >= 0 && u + v <= 1)) return;
        const auto at = static_cast<float>(dot(e2, q) / determinant);
        if (!(at >= ray.tnear && at < ray.tfar)) return;
        const auto normal = cross(e1, e2);
        RTCHit found{static_cast<float>(normal[0]),
                     static_cast<float>(normal[1]),
                     static_cast<float>(normal[2]),
                     static_cast<float>(u),
                     static_cast<float>(v),
                     t,
                     0,
                     {}};
        if (context->filter) {
            int valid = -1;
            RTCRay tried = ray;
            tried.tfar = at;
            const RTCFilterFunctionNArguments arguments{&valid, nullptr, context, &tried, &found, 1};
            context->filter(&arguments);
            if (valid != -1) return;
        }
        ray.tfar = at;
        hit->hit = found;
    };
    std::array<int, deepest> waiting;
    std::size_t count = 0;
    if (!scene->nodes.empty()) waiting[count++] = 0;
    while (count > 0) {
        const int at = waiting[--count];
        const RTCTree::Node& node = scene->nodes[static_cast<std::size_t>(at)];
        if (!reaches(node.box)) continue;
        for (int k = node.first; k < node.first + node.count; ++k)
            look_at(scene->order[static_cast<std::size_t>(k)]);
        if (node.count == 0) waiting[count++] = node.right, waiting[count++] = at + 1;
    }
}

bool rtcPointQuery(RTCScene scene, RTCPointQuery* query, RTCPointQueryContext*, RTCPointQueryFunction visit,
                   void* user) {
    const Corner at{query->x, query->y, query->z};
    const auto square = [&](int node) {
        return scene->nodes[static_cast<std::size_t>(node)].box.square_distance(at);
    };
    std::array<int, deepest> waiting;
    std::size_t count = 0;
    bool changed = false;
    if (!scene->nodes.empty()) waiting[count++] = 0;
    while (count > 0) {
        const int next = waiting[--count];
        if (square(next) > query->radius * query->radius) continue;
        const RTCTree::Node& node = scene->nodes[static_cast<std::size_t>(next)];
        for (int k = node.first; k < node.first + node.count; ++k) {
            RTCPointQueryFunctionArguments arguments{query, user, scene->order[static_cast<std::size_t>(k)],
                                                     0};
            changed = visit(&arguments) || changed;
        }
        if (node.count > 0) continue;
        // The nearer half first.
        const bool left = square(next + 1) <= square(node.right);
        waiting[count++] = left ? node.right : next + 1;
        waiting[count++] = left ? next + 1 : node.right;
    }
    return changed;
}
