#pragma once
/// The view into the patient without its display: what is drawn by OpenGL in the teacher's window and by
/// WebGL in the page, and by which shaders.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "engine/anatomy/anatomy.h"
#include "engine/room/session.h"
#include "render/panel/palette.h"

namespace room {

/// Dark blue over green to yellow, which people with red-green colour blindness can distinguish.
render::Ink force_colour(double force);
/// From 0, the least force of the scale, to 1.
render::Ink legend_colour(double part);
/// "wall force 0.001 to 0.5 N".
std::string force_legend();

struct PatientVertex {
    Eigen::Vector3f place, normal, tint;  // [mm], [-], of 1; (0, 0, 0) is no normal
};
/// Triangles, or lines where it says so.
struct PatientMesh {
    std::vector<PatientVertex> vertices;
    std::vector<unsigned> indices;
};

PatientMesh lumen_mesh(const anatomy::Anatomy&, const std::vector<Eigen::Vector3f>& moves);
/// The devices with eight sides, as thick as the outermost is, coloured by the wall's force.
PatientMesh device_mesh(const SolverView&);
/// Lines: how hard the wall presses, and from where.
PatientMesh force_lines(const SolverView&);
PatientMesh target_mesh(const geometry::Vec3& centre, double radius);

/// How a mesh is laid over what lies behind it.
struct Veil {
    float opacity, rim;  // `rim` makes edge-on surfaces more opaque, so that a vessel shows its outline
};
constexpr Veil solid{1, 0}, target_veil{0.25f, 0.6f}, lumen_veil{0.2f, 0.8f};

/// From the patient's front, head up, as in the image; it looks at the tip, or the target.
struct Eye {
    float azimuth = 0, elevation = 0.15f, distance = 320;                                 // [rad], [mm]
    static constexpr float steepest = 1.5f, nearest = 15, farthest = 2000, field = 0.7f;  // field: [rad]

    void turn(float right, float up);
    /// Nearer by a factor below 1.
    void zoom(float factor);
};

/// Without their first line, the version of the display's language.
extern const char* const patient_vertex_shader;
extern const char* const patient_fragment_shader;

}  // namespace room
