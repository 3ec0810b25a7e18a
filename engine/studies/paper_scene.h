#pragma once
/// What the studies of the paper share: its wire in the tube of a scene, its methods, and b, A, s and R of
/// every segment (Eqs. 4 and 12).

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/io/plot.h"
#include "physics/relax/relaxer.h"
#include "physics/wall/tube_wall.h"
#include "physics/wire/chain.h"

namespace studies {

/// A wire on the centreline of a scene's tube.
struct PaperScene {
    std::string name;
    std::shared_ptr<const physics::TubeWall> wall;
    geometry::Polyline path;  // centreline of the tube before it was cut into pieces
    physics::Chain start;
    double stiffness = 0;  // k of a joint [N/mm]

    int segments() const { return start.segments(); }
    /// "scene sinuous, lumen radius 1 mm, N = 200, λ = 1 mm, EI = 50 N·mm², k = 42 N/mm a joint".
    std::string text() const;
};

/// Changes to a scene; zero = unchanged.
struct SceneChange {
    int segments = 0;
    double segment_length = 0;  // λ; k of a joint stays, as in the paper [mm]
    double radius = 0;          // of the lumen [mm]
    double piece = 0;           // the artery in straight pieces of this length [mm]
    double first_piece = 0;     // length of the first of them; 0 = as the others [mm]
    double bends = 1;           // radii of the bends times this
    double stiffness = 1;       // k times this
};
PaperScene paper_scene(const char* name, const SceneChange& = {});

/// A method, its name in pictures, and the style of its line there.
struct NamedMethod {
    std::string name;
    physics::RelaxerConfig config;
    std::string look;
};
/// The paper's method as published, without safeguard: "M = 2", in the colour of its M. A separation of 0
/// means that Algorithm 2 chooses it.
NamedMethod paper_method(int varied_segments, int separation = 0);

/// A wire, and how close to rest it is.
struct Rest {
    physics::Chain wire;
    double gradient = 0;  // |g|/C [-]
    double energy = 0;    // [N·mm]
    double wall = 0;      // the wall's part of it [N·mm]
};
Rest as_it_is(const physics::LumenWall&, physics::Chain);
/// What the paper takes as equilibrium: the wire after 200 cycles, here with M = 2.
Rest paper_rest(const PaperScene&, int cycles = 200);
/// Rest to a gradient over C of 1e-8, found by the global relaxer.
Rest global_rest(const physics::LumenWall&, physics::Chain from);

/// The rest of a wire as long as `rest`, of other segments, from the same shape: so that the number of
/// segments changes and not the basin.
Rest rest_again(const PaperScene&, const physics::Chain& rest);

double farthest_joint(std::span<const geometry::Vec3>, std::span<const geometry::Vec3>);  // [mm]
inline double farthest_joint(const physics::Chain& a, const physics::Chain& b) {
    return farthest_joint(a.joints, b.joints);
}

/// [i] is that of segment i; [0] is not used.
struct SegmentTerms {
    std::vector<geometry::Vec3> pull;           // q = b − s₍i,N₎ [N·mm]
    std::vector<geometry::Mat3> bending, wall;  // A_i and R₍i,N₎ [N·mm]
    std::vector<int> touching;                  // joints in touch, ascending

    int last_touching() const { return touching.empty() ? -1 : touching.back(); }
    /// Number of joints in touch from i to j − 1.
    int touching_between(int i, int j) const;
};

SegmentTerms segment_terms(const PaperScene&, const physics::Chain&);

}  // namespace studies
