#pragma once
/// The vessels and wires of the study of speed against accuracy.

#include <memory>
#include <string>
#include <vector>

#include "engine/studies/plain_wire.h"
#include "engine/studies/rivals/rival.h"
#include "engine/studies/study.h"
#include "physics/geometry/vec.h"
#include "physics/wall/wall.h"
#include "physics/wire/chain.h"

namespace studies {

/// A vessel and the uniform or floppy-tipped wire that goes into it. Ends stand for half a segment.
struct ParetoVessel {
    std::string name;
    std::shared_ptr<const physics::LumenWall> wall;
    geometry::Polyline path;
    PlainWire spec;
    int segments = 0;
    double stiffness = 0;  // k of a joint [N/mm]
    /// The same tube by the rivals' own geometry, and the wire for them; null for a mesh.
    std::shared_ptr<const rivals::Tube> tube;
    rivals::RodSpec rod;

    /// "sinuous: N = 200, λ = 1 mm, EI = 50 N·mm², k = 42 N/mm".
    std::string text() const;
    /// A wire on the centreline. The first search for every joint's station is not charged to any method.
    physics::Chain wire(int segments) const;
};

/// EA of a round solid wire of rigidity EI that is 0.014 in thick: 16 EI/d² [N].
double round_wire_axial(double bending);

/// The scene as a tube in closed form.
ParetoVessel scene_vessel(const char* name, bool quick);
/// The four tubes; `quick`: one, shorter.
std::vector<ParetoVessel> pareto_tubes(bool quick);
/// The spatial tube and an iliac artery as meshes, their walls distance fields.
std::vector<ParetoVessel> pareto_meshes(const StudyOptions&);

}  // namespace studies
