#pragma once
/// The state of an exercise after a frame in numbers: what a program that acts can see.

#include <memory>
#include <optional>
#include <vector>

#include "engine/anatomy/vessel_ways.h"
#include "engine/exercise/exercise.h"
#include "physics/geometry/polyline.h"
#include "physics/geometry/vec.h"

namespace episode {

/// What a hand does to a device and feels of it.
struct Hand {
    double inserted = 0;  // [mm]
    double turned = 0;    // since the start [rad]
    double push = 0;      // > 0 where the hand pushes [N]
    double torque = 0;    // [N·mm]

    void state(geometry::StateStream& s) { s(inserted, turned, push, torque); }
};

/// Places are those of the room at the frame's end: breath and heartbeat have moved them.
struct Reading {
    exercise::FrameTime time;
    geometry::Vec3 tip = geometry::Vec3::Zero();        // of the device that the exercise is about [mm]
    geometry::Vec3 direction = geometry::Vec3::Zero();  // there, unit
    geometry::Vec3 target = geometry::Vec3::Zero();     // [mm]
    geometry::Vec3 shift = geometry::Vec3::Zero();      // of the vessels by breath and heartbeat [mm]
    int branch = -1;                                    // of the anatomy, nearest to the tip
    double along = 0;                                   // that branch, from its start [mm]
    std::optional<double> path_to_target;               // along centrelines; empty where there is no way [mm]
    double tip_to_target = 0;                           // straight [mm]
    Hand wire, catheter;
    double tip_force = 0;     // of the last joint on the wall [N]
    double wall_force = 0;    // the largest of one joint [N]
    double air_kerma = 0;     // of the attempt, where dose is measured [mGy]
    double area_product = 0;  // [Gy·cm²]
    bool settling = false;    // the wire is on its way to rest: the one shown is the last at rest
    bool at_rest = true;      // the wire shown is an equilibrium within the solver's tolerance
    bool certified = true;    // and a strict minimum, with nothing asked for that was refused or waits
    bool refused = false, buckled = false, too_thick = false;
    bool insertion_stopped = false, withdrawal_stopped = false, whole_wire_is_in = false;
    bool completed = false;   // the tip has stayed in the target for its hold
    bool on_target = false;   // the tip is within the target's radius
    bool time_is_up = false;  // or the beam's
};

/// Follows an exercise frame by frame.
class Reader {
public:
    explicit Reader(const exercise::Simulation&);
    /// To be called after each frame.
    void observe(const exercise::Frame&);
    /// Finds another target.
    void aim(const exercise::Simulation&);
    Reading read(const exercise::Exercise&) const;
    /// Length of the shortest way along centrelines from a place to the target; empty without one [mm].
    std::optional<double> way_from(const exercise::Simulation&, const geometry::Vec3& place) const;
    void state(geometry::StateStream& s) {
        s(wire_, catheter_, at_rest_, minimum_, settling_, refused_, buckled_, too_thick_, insertion_stopped_,
          withdrawal_stopped_, whole_wire_is_in_, waits_);
    }

private:
    std::shared_ptr<const anatomy::VesselWays> ways_;
    anatomy::VesselPlace target_;
    Hand wire_, catheter_;
    bool at_rest_ = true, minimum_ = true, settling_ = false, refused_ = false, buckled_ = false,
         too_thick_ = false, insertion_stopped_ = false, withdrawal_stopped_ = false,
         whole_wire_is_in_ = false, waits_ = false;
};

/// Points on a device from its tip toward the introducer, so many at such a distance; where the device ends
/// before, its last point is repeated. `line` runs from the introducer to the tip; all zero where it is
/// empty.
void track(const geometry::Polyline& line, double spacing, std::vector<geometry::Vec3>& points);

}  // namespace episode
