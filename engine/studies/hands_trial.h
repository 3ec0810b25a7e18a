#pragma once
/// What the manipulations of the study of hands share.

#include <string>
#include <vector>

#include "engine/studies/hands_behaviours.h"

namespace studies {

/// A course, and what is written of it. It begins with the wire turned and fed by long steps, and drawn
/// there.
class Trial {
public:
    Trial(const StudyOptions&, const Behaviour&);

    HandCourse course;
    /// Keeps where every device lies now.
    void draw(const std::string& moment);
    static constexpr double far_turn = 5 * geometry::degree;
    /// Steps for the way to where something is measured.
    void far_steps() { course.feed_step = quick_ ? 1.0 : 0.5; }
    void fine_steps() { course.feed_step = quick_ ? 0.25 : 0.1; }
    /// The vessel that holds the place deepest.
    struct Place {
        std::string vessel;
        double along = 0;  // from its start [mm]
    };
    Place place_of(const Vec3&) const;
    std::string vessel_at(const Vec3& x) const { return place_of(x).vessel; }
    /// The lowest place of a path past the plane at which the aortic root begins [mm].
    double past_junction(const Polyline&) const;
    /// Past this is the ventricle: where the cusps' lowest places are, and 2 mm of their wall [mm].
    double depth_of_root() const;
    /// How far the end of the path rises again above its lowest place, where that is in the ascending aorta,
    /// within 90 mm of the root along the vessel; else 0 [mm].
    double leg_in_ascending_aorta(const Polyline&) const;
    BehaviourRun finish(double measured, bool appears, const std::string& note,
                        script::Held shown = script::Held::Wire);

private:
    BehaviourRun run_;
    bool quick_;
};

}  // namespace studies
