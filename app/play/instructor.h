#pragma once
/// The instructor's view: the vessel in 3D with the wire in it, coloured by the force of the wall, and what
/// the solver did for it.

#include <deque>
#include <memory>
#include <optional>

#include "app/play/window.h"
#include "engine/anatomy/anatomy.h"
#include "engine/room/session.h"

namespace app {

class Instructor {
public:
    explicit Instructor(const Gl&);
    ~Instructor();
    Instructor(const Instructor&) = delete;
    Instructor& operator=(const Instructor&) = delete;

    /// Another session: what was drawn is forgotten.
    void reset();
    /// Draws it over the area [pixels]. `target` and its `radius` [mm]. Returns what the instructor changed.
    std::optional<exercise::Tuning> draw(const room::View&, const anatomy::Anatomy&,
                                         const geometry::Vec3& target, double radius, const render::Box&,
                                         const Window&);

private:
    struct Scene;
    std::unique_ptr<Scene> scene_;
};

}  // namespace app
