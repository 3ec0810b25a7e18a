#pragma once
/// Ways of breaking a relaxation: wires and vessels that are difficult for every method.

#include <memory>
#include <string>
#include <vector>

#include "engine/studies/study.h"
#include "physics/wall/wall.h"
#include "physics/wire/chain.h"

namespace studies {

/// One thing done to the wire; it is relaxed afterwards.
struct Disturbance {
    int inserted = 0;  // segments, all at once
    double turn = 0;   // of the hub [rad]
};

/// Symmetry of vessel and start: shapes that it maps onto each other count as one.
enum class Symmetry {
    None,
    MirrorZ,     // in the plane z = 0
    RoundAboutX  // a turn about the x axis, or a mirror
};

struct BreakingCase {
    std::string id, what;  // a word for files; a few words for people
    std::string how;       // a sentence: vessel, wire, what is done
    std::shared_ptr<const physics::LumenWall> wall;
    physics::Chain start;
    std::vector<Disturbance> disturbances;  // in order; empty: the start is relaxed as it is
    int cycles = 100;  // total work, in relaxation cycles of the wire as it is at the end
    Symmetry symmetry = Symmetry::None;
    /// The reference starts with a bow of 1e-4 rad, because an exactly balanced start stays where it is.
    bool bowed_reference = false;
};

/// In the order of the map. Quick ones are shorter and get less work. Throws InputError without the anatomy.
std::vector<BreakingCase> breaking_cases(const StudyOptions&);

}  // namespace studies
