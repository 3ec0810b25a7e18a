#include "render/xray/gl_camera.h"

#include <cmath>
#include <glm/ext/matrix_clip_space.hpp>
#include <glm/ext/matrix_transform.hpp>

namespace render {

glm::dmat4 view_matrix(const CArm& arm) {
    const ArmAxes a = axes(arm);
    const auto vector = [](const geometry::Vec3& v) { return glm::dvec3(v.x(), v.y(), v.z()); };
    return glm::lookAt(vector(-arm.sod * a.beam), glm::dvec3(0), vector(a.up));
}

glm::dmat4 projection_matrix(const CArm& arm) {
    constexpr double near = 1, far = 2;  // any values will do: z is removed
    const double opening = 2 * std::atan(0.5 * arm.detector_width / arm.sid);
    return glm::scale(glm::dmat4(1), glm::dvec3(-1, -1, 0)) * glm::perspective(opening, 1.0, near, far);
}

}  // namespace render
