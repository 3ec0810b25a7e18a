#pragma once
/// The way out of a dead end: continuation in the stiffness of the wall.

#include "physics/relax/descent.h"

namespace physics {

/// What a descent in the wall itself needs, and what it adds to.
struct WallDescent {
    const LumenWall& wall;
    ContactSet& contacts;  // of the wall itself
    const GlobalOptions& options;
    RelaxReport& report;
    const UpdateObserver& observer;
};

/// A stiff wall lets only tiny steps through: finds the way with a softer one, then hardens it. The result
/// counts only if it is lower than before, for a soft wall also lets the wire out of the vessel. Until then
/// the wire that is asked for stays where it was stuck, also where the budget ends; the next call goes on.
class SofterWalls {
public:
    bool under_way() const { return stiffness_ > 0; }
    void forget() { *this = {}; }

    /// Termination as Descent::run(); Stuck where there is nothing lower at the end. Ignores the task's
    /// window: all segments move.
    Termination run(Iterate&, Chain&, const WallDescent&, const DescentTask&);

    void state(StateStream& s) { s(stiffness_, energy_, spent_, wire_); }

private:
    void start(Iterate&, const Chain&, const WallDescent&);
    Termination descend(Iterate&, const WallDescent&, const DescentTask&, double wall_stiffness);
    double reached(Iterate&, const WallDescent&) const;
    Termination give_up(Iterate&, Chain&, const WallDescent&, bool cut, double mu);

    double stiffness_ = 0;  // of the wall it is in now, 0 = none is under way [N/mm]
    double energy_ = 0;     // where the wire was stuck [N·mm]
    int spent_ = 0;         // updates in this wall
    Chain wire_;            // on its way
};

}  // namespace physics
