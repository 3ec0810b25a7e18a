#pragma once
/// Handling errors of an attempt, which the room counts in addition to the score.

#include "engine/exercise/frame.h"
#include "physics/geometry/state.h"

namespace room {

struct Handling {
    int blind_motions = 0;  // times the wire was moved without beam
    int against_stops = 0;  // times it was pushed or pulled against a stop
    int taken_back = 0;     // times the last seconds were taken back
    bool moves_blind = false, at_stop = false;

    void observe(const exercise::Frame&);
    int errors() const { return blind_motions + against_stops; }
    void state(geometry::StateStream& s) { s(blind_motions, against_stops, moves_blind, at_stop); }
};

}  // namespace room
