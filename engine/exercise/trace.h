#pragma once
/// The exercise in numbers, a row per frame and device: where each device is and what the hand feels of it.

#include <string>

#include "engine/anatomy/vessel_ways.h"
#include "engine/exercise/frame.h"
#include "engine/exercise/score.h"

namespace exercise {

class Trace {
public:
    explicit Trace(const Simulation&);

    /// Names and units of the columns, a line of CSV.
    static std::string header();
    /// The rows of a frame, wire and catheter; call it once for each frame. A device that is out has empty
    /// cells for its place. Contacts are those of the joints at which the device lies outermost. Lengths are
    /// those of the wire shown: the last at rest. Forces and torque are positive where the hand must push and
    /// hold the hub back; an empty cell stands for a missing value: no way from the tip's branch to the
    /// target's, no dose without images.
    std::string rows(const Frame&, const Score&);

private:
    anatomy::VesselWays ways_;
    anatomy::VesselPlace target_;
    /// What is known of a device's hub.
    struct Hand {
        double turned = 0;  // since the attempt began [rad]
        physics::HubLoad load;
    };
    std::string row(script::Held, const Hand&, const Frame&, const Score&) const;

    Hand wire_, catheter_;
};

}  // namespace exercise
