#pragma once
/// The vessels in 3D with the devices in them, coloured by the wall's force, drawn into a texture.

#include <memory>

#include "app/play/gl.h"
#include "engine/anatomy/anatomy.h"
#include "engine/room/patient_mesh.h"

namespace app {

class PatientScene {
public:
    explicit PatientScene(const Gl&);
    ~PatientScene();
    PatientScene(const PatientScene&) = delete;
    PatientScene& operator=(const PatientScene&) = delete;

    /// Forgets the vessels and the target of the previous session.
    void reset();
    /// Moves the eye around the tip [rad], or nearer to it (factor below 1) and farther away.
    void turn(float right, float up);
    void zoom(float factor);
    /// Draws what has changed and returns the texture, `width` x `height` pixels, first row at the bottom.
    /// Without a solver view there are no devices. `target` and its `radius` [mm]. Throws io::InputError
    /// where the display's OpenGL lacks what this needs.
    GLuint picture(const room::View&, const anatomy::Anatomy&, const geometry::Vec3& target, double radius,
                   int width, int height);

private:
    struct Content;
    std::unique_ptr<Content> content_;
};

}  // namespace app
