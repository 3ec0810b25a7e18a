#pragma once
/// The vessel in 3D with the wire in it, coloured by the force of the wall, drawn into a texture.

#include <memory>

#include "app/play/gl.h"
#include "engine/anatomy/anatomy.h"
#include "engine/room/session.h"
#include "render/panel/palette.h"

namespace app {

constexpr double least_force = 1e-3, most_force = 0.5;  // ends of the scale of colours [N]

/// Dark blue over green to yellow, which eyes that miss red or green can distinguish.
render::Ink force_colour(double force);

class SolverScene {
public:
    explicit SolverScene(const Gl&);
    ~SolverScene();
    SolverScene(const SolverScene&) = delete;
    SolverScene& operator=(const SolverScene&) = delete;

    /// Forgets the vessels and the target of the session before.
    void reset();
    /// Moves the eye around the tip [rad], or nearer (factor below 1) and farther.
    void turn(float right, float up);
    void zoom(float factor);
    /// Draws what has changed and returns the texture, `width` x `height` pixels, first row at the bottom.
    /// The view has a solver view. `target` and its `radius` [mm]. Throws io::InputError where the display's
    /// OpenGL cannot do it.
    GLuint picture(const room::View&, const anatomy::Anatomy&, const geometry::Vec3& target, double radius,
                   int width, int height);

private:
    struct Content;
    std::unique_ptr<Content> content_;
};

}  // namespace app
