#pragma once
/// The instructor's view: the vessel in 3D with the wire in it, coloured by the wall's force, and what the
/// solver did for it.

#include <deque>
#include <optional>

#include "app/play/solver_scene.h"
#include "app/play/window.h"
#include "engine/anatomy/anatomy.h"
#include "engine/room/session.h"

namespace app {

class Instructor {
public:
    explicit Instructor(const Gl&);

    /// Starts another session: forgets what was drawn.
    void reset();
    /// Draws the view over the area [pixels]. `target` and its `radius` [mm]. Returns what the instructor
    /// changed.
    std::optional<exercise::Tuning> draw(const room::View&, const anatomy::Anatomy&,
                                         const geometry::Vec3& target, double radius, const render::Box&,
                                         const Window&);

private:
    void remember(const room::View&);
    void draw_speed_against_accuracy(float unit, double frame_ms) const;
    std::optional<exercise::Tuning> draw_controls(const exercise::Tuning& now, float unit);

    struct Dot {
        double ms, error;  // of a frame's motion, and how far from rest it left the wire [mm]
        int method;
    };
    SolverScene scene_;
    std::deque<float> motion_ms_, image_ms_, steps_, residual_;  // of the last frames
    std::deque<Dot> dots_;                                       // of frames with a motion
    std::optional<exercise::Tuning> edited_;                     // by sliders being held
    long seen_ = -1;                                             // frame
};

}  // namespace app
