#include "engine/anatomy/import/voxel_steps.h"

#include <algorithm>
#include <vector>

#include "engine/anatomy/import/edge_uses.h"

namespace anatomy {

using geometry::TriangleMesh;
using geometry::Vec3;
using Triangle = std::array<int, 3>;

bool is_made_of_steps(const TriangleMesh& mesh) {
    constexpr double most_along_axes = 0.6, cosine = 0.97, most_along_one = 0.65;
    Vec3 along = Vec3::Zero();
    double whole = 0;
    for (const Triangle& t : mesh.triangles) {
        const Vec3& a = mesh.vertices[t[0]];
        const Vec3 normal = (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a);
        whole += normal.norm();
        int axis = 0;
        if (normal.cwiseAbs().maxCoeff(&axis) > cosine * normal.norm()) along[axis] += normal.norm();
    }
    return along.sum() > most_along_axes * whole && along.maxCoeff() < most_along_one * along.sum();
}

void smooth(TriangleMesh& mesh, int rounds) {
    std::vector<char> rim(mesh.vertices.size(), 0);
    EdgeUses(mesh.triangles).each([&](const auto* first, const auto* last) {
        if (last - first == 1) rim[first->low] = rim[first->high] = 1;
    });
    std::vector<Vec3> sums(mesh.vertices.size());
    std::vector<int> counts(mesh.vertices.size());
    for (int pass = 0; pass < 2 * rounds; ++pass) {
        std::fill(sums.begin(), sums.end(), Vec3::Zero());
        std::fill(counts.begin(), counts.end(), 0);
        for (const Triangle& t : mesh.triangles) {
            for (int k = 0; k < 3; ++k) {
                sums[t[k]] += mesh.vertices[t[(k + 1) % 3]] + mesh.vertices[t[(k + 2) % 3]];
                counts[t[k]] += 2;
            }
        }
        const double step = pass % 2 == 0 ? 0.5 : -0.53;
        for (std::size_t v = 0; v < sums.size(); ++v) {
            if (counts[v] > 0 && !rim[v]) mesh.vertices[v] += step * (sums[v] / counts[v] - mesh.vertices[v]);
        }
    }
}

}  // namespace anatomy
