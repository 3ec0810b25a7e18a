#pragma once
/// What the solver did for the devices, and what of their model may be changed meanwhile.

#include <deque>
#include <optional>

#include "engine/room/session.h"

namespace app {

class SolverPage {
public:
    /// Starts another session: forgets what was drawn.
    void reset();
    /// Of each view, also while the page is not shown.
    void observe(const room::View&);
    /// Draws into the ImGui window that is begun; `unit` as a window's [pixels]. Returns what was changed,
    /// where that is allowed.
    std::optional<exercise::Tuning> draw(const room::View&, bool may_tune, float unit);

private:
    void draw_speed_against_accuracy(float unit, double frame_ms) const;
    std::optional<exercise::Tuning> draw_controls(const exercise::Tuning& now, float unit);

    struct Dot {
        double ms, error;  // of a frame's motion, and how far from rest it left the wire [mm]
        int method;
    };
    std::deque<float> motion_ms_, image_ms_, steps_, residual_;  // of the last frames
    std::deque<Dot> dots_;                                       // of frames with a motion
    std::optional<exercise::Tuning> edited_;                     // by sliders being held
    long seen_ = -1;                                             // frame
};

}  // namespace app
