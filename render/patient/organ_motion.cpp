#include "render/patient/organ_motion.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <string_view>

#include "physics/geometry/random.h"
#include "render/patient/patient_parts.h"

namespace render {
namespace {

bool is_one_of(std::string_view name, std::initializer_list<std::string_view> names) {
    return std::find(names.begin(), names.end(), name) != names.end();
}

bool breathes(std::string_view name) {
    return is_one_of(name, {"left lung", "right lung", "lung vessels", "heart", "diaphragm", "bowel gas",
                            "abdominal fat", "left kidney", "left kidney cortex", "left kidney medulla",
                            "right kidney", "right kidney cortex", "right kidney medulla"});
}

bool follows_the_heart(std::string_view name) {
    return is_one_of(name, {"heart", "left lung", "right lung", "lung vessels"});
}

/// Each bubble, a part of the mesh that hangs together, is carried 3 to 7 mm by the bowel, most of it across
/// the body and up or down, as its loops run.
std::vector<Eigen::Vector3f> carried(const geometry::TriangleMesh& gas) {
    constexpr double least = 3.0, most = 7.0;  // [mm]
    std::vector<std::uint32_t> part(gas.vertices.size());
    std::iota(part.begin(), part.end(), 0u);
    const auto root = [&](std::uint32_t v) {
        while (part[v] != v) v = part[v] = part[part[v]];
        return v;
    };
    for (const auto& triangle : gas.triangles) {
        for (int k = 0; k < 2; ++k) {
            const std::uint32_t a = root(static_cast<std::uint32_t>(triangle[k])),
                                b = root(static_cast<std::uint32_t>(triangle[k + 1]));
            part[std::max(a, b)] = std::min(a, b);
        }
    }
    std::vector<Eigen::Vector3f> motions(gas.vertices.size(), Eigen::Vector3f::Zero());
    for (std::uint32_t v = 0; v < part.size(); ++v) {
        const std::uint32_t first = root(v);
        if (first != v) {
            motions[v] = motions[first];  // the first vertex of a part comes first
            continue;
        }
        geometry::Random random(first);
        const double z = random.between(-1, 1), y = random.between(-0.4, 0.4), x = random.between(-1, 1);
        Vec3 direction(x, y, z);
        const double length = random.between(least, most);
        direction = direction.norm() > 0.1 ? Vec3(direction.normalized()) : Vec3(Vec3::UnitZ());
        motions[v] = (length * direction).cast<float>();
    }
    return motions;
}

}  // namespace

double breathing_fraction(double height) {
    constexpr double rows[][2] = {{-160, 0},  {-60, 0.2}, {20, 0.55}, {80, 0.67},
                                  {150, 0.8}, {210, 1.0}, {250, 0.9}, {410, 0.0}};
    if (height <= rows[0][0] || height >= 410.0) return 0.0;
    return interpolated(rows, height);
}

void move_organs(std::vector<TissueLayer>& layers, const Vec3& origin, double breath,
                 const std::function<Vec3(const Vec3&)>& systole) {
    for (TissueLayer& layer : layers) {
        if (breath != 0.0 && layer.name == "bowel gas") layer.drift = carried(layer.mesh);
        if (breath != 0.0 && breathes(layer.name)) {
            layer.breath.reserve(layer.mesh.vertices.size());
            for (const Vec3& v : layer.mesh.vertices)
                layer.breath.emplace_back(
                    0.0f, 0.0f, static_cast<float>(-breath * breathing_fraction(v.z() - origin.z())));
        }
        if (systole && follows_the_heart(layer.name)) {
            layer.beat.reserve(layer.mesh.vertices.size());
            for (const Vec3& v : layer.mesh.vertices) layer.beat.push_back(systole(v).cast<float>());
        }
    }
}

}  // namespace render
