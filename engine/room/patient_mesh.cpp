#include "engine/room/patient_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <numbers>

namespace room {
namespace {

using Eigen::Vector3f;

constexpr double least_force = 1e-3, most_force = 0.5;  // ends of the colour scale [N]
constexpr float force_length = 40;                      // length of a line that represents 1 N [mm]
constexpr float thicker = 2;  // than they are devices are drawn, to be seen from a distance

Vector3f tint_of(render::Ink ink) {
    return Vector3f(ink.red, ink.green, ink.blue) / 255.0f;
}

/// Adds two triangles between each side of a ring of vertices and the ring before it. `ring` is the index of
/// its first vertex.
void join_to_last_ring(std::vector<unsigned>& indices, std::size_t ring, unsigned sides) {
    const auto first = static_cast<unsigned>(ring);
    for (unsigned k = 0; k < sides; ++k) {
        const unsigned next = (k + 1) % sides, a = first - sides + k, b = first - sides + next;
        for (const unsigned corner : {a, b, a + sides, b, b + sides, a + sides}) indices.push_back(corner);
    }
}

}  // namespace

const char* const patient_vertex_shader = R"(layout(location = 0) in vec3 place;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 tint;
uniform mat4 camera;
uniform vec3 shift;
out vec3 world, facing, shade;
void main() {
    world = place + shift;
    facing = normal;
    shade = tint;
    gl_Position = camera * vec4(world, 1.0);
})";

// Lit from the eye.
const char* const patient_fragment_shader = R"(in vec3 world, facing, shade;
uniform vec3 eye;
uniform float opacity, rim;
out vec4 colour;
void main() {
    float size = length(facing);
    float slant = size > 0.0 ? abs(dot(facing / size, normalize(eye - world))) : 1.0;
    colour = vec4(shade * (0.55 + 0.45 * slant), clamp(opacity + rim * pow(1.0 - slant, 2.0), 0.0, 1.0));
})";

render::Ink legend_colour(double part) {
    static constexpr std::array<render::Ink, 5> stops = {
        {{107, 115, 204}, {59, 153, 191}, {51, 191, 140}, {153, 217, 77}, {255, 235, 51}}};
    const double at = std::clamp(part, 0.0, 1.0) * (stops.size() - 1);
    const std::size_t first = std::min<std::size_t>(stops.size() - 2, static_cast<std::size_t>(at));
    const auto mixed = [&](std::uint8_t a, std::uint8_t b) {
        return static_cast<std::uint8_t>(std::lround(std::lerp(a, b, at - static_cast<double>(first))));
    };
    const render::Ink &low = stops[first], &high = stops[first + 1];
    return {mixed(low.red, high.red), mixed(low.green, high.green), mixed(low.blue, high.blue)};
}

render::Ink force_colour(double force) {
    return legend_colour(
        force <= least_force ? 0 : std::log(force / least_force) / std::log(most_force / least_force));
}

std::string force_legend() {
    return fmt::format("wall force {:g} to {:g} N", least_force, most_force);
}

PatientMesh lumen_mesh(const anatomy::Anatomy& anatomy, const std::vector<Vector3f>& moves) {
    geometry::TriangleMesh mesh = anatomy.lumen;
    for (std::size_t k = 0; k < moves.size(); ++k) mesh.vertices[k] += moves[k].cast<double>();
    PatientMesh made;
    made.vertices.resize(mesh.vertices.size());
    for (std::size_t k = 0; k < made.vertices.size(); ++k)
        made.vertices[k] = {mesh.vertices[k].cast<float>(), Vector3f::Zero(), Vector3f(0.95f, 0.55f, 0.48f)};
    made.indices.reserve(3 * mesh.triangles.size());
    for (const auto& t : mesh.triangles) {
        const geometry::Vec3 normal =
            (mesh.vertices[t[1]] - mesh.vertices[t[0]]).cross(mesh.vertices[t[2]] - mesh.vertices[t[0]]);
        for (int k = 0; k < 3; ++k) {
            made.vertices[t[k]].normal += normal.cast<float>();
            made.indices.push_back(static_cast<unsigned>(t[k]));
        }
    }
    return made;
}

PatientMesh device_mesh(const SolverView& solver) {
    constexpr int around = 8;
    PatientMesh made;
    const std::size_t count = solver.joints.size();
    Vector3f across(0, 1, 0);
    for (std::size_t i = 0; i < count; ++i) {
        const geometry::Vec3 along =
            solver.joints[std::min(i + 1, count - 1)] - solver.joints[i == 0 ? 0 : i - 1];
        const Vector3f forward = (along.cast<float>() + Vector3f::Constant(1e-6f)).normalized();
        across -= across.dot(forward) * forward;
        if (across.norm() < 1e-3f) across = forward.cross(Vector3f(0.3f, 0.8f, 0.5f));
        across.normalize();
        const Vector3f up = forward.cross(across);
        const double force = i < solver.contacts.size() ? solver.contacts[i].force() : 0;
        const Vector3f tint = tint_of(force_colour(force));
        const float radius = thicker * (i < solver.radii.size() ? solver.radii[i] : 0.45f);
        for (int k = 0; k < around; ++k) {
            const float angle = 2 * std::numbers::pi_v<float> * static_cast<float>(k) / around;
            const Vector3f normal = std::cos(angle) * across + std::sin(angle) * up;
            made.vertices.push_back({solver.joints[i].cast<float>() + radius * normal, normal, tint});
        }
        if (i > 0) join_to_last_ring(made.indices, made.vertices.size() - around, around);
    }
    return made;
}

PatientMesh force_lines(const SolverView& solver) {
    PatientMesh made;
    for (std::size_t i = 0; i < std::min(solver.joints.size(), solver.contacts.size()); ++i) {
        const physics::WallContact& contact = solver.contacts[i];
        if (!contact.touches()) continue;
        const Vector3f from = solver.joints[i].cast<float>(), tint = tint_of(force_colour(contact.force()));
        const float length = std::clamp(force_length * static_cast<float>(contact.force()), 2.0f, 40.0f);
        for (const Vector3f& place : {from, Vector3f(from - length * contact.normal.cast<float>())}) {
            made.indices.push_back(static_cast<unsigned>(made.vertices.size()));
            made.vertices.push_back({place, Vector3f::Zero(), tint});
        }
    }
    return made;
}

PatientMesh target_mesh(const geometry::Vec3& centre, double radius) {
    constexpr int rings = 12, sides = 18;
    PatientMesh made;
    for (int j = 0; j <= rings; ++j) {
        for (int k = 0; k < sides; ++k) {
            const float polar = std::numbers::pi_v<float> * static_cast<float>(j) / rings,
                        turn = 2 * std::numbers::pi_v<float> * static_cast<float>(k) / sides;
            const Vector3f normal(std::sin(polar) * std::cos(turn), std::sin(polar) * std::sin(turn),
                                  std::cos(polar));
            made.vertices.push_back({centre.cast<float>() + static_cast<float>(radius) * normal, normal,
                                     Vector3f(0.96f, 0.80f, 0.24f)});
        }
        if (j > 0) join_to_last_ring(made.indices, made.vertices.size() - sides, sides);
    }
    return made;
}

void Eye::turn(float right, float up) {
    azimuth -= right;
    elevation = std::clamp(elevation + up, -steepest, steepest);
}

void Eye::zoom(float factor) {
    distance = std::clamp(distance * factor, nearest, farthest);
}

}  // namespace room
