#pragma once
/// The study of speed against accuracy: its vessels and wires, and the methods, ours and others', behind one
/// interface.

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "engine/studies/baselines/baseline.h"
#include "engine/studies/plain_wire.h"
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
    std::shared_ptr<const baselines::Tube> tube;
    baselines::RodSpec rod;

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

/// Counted work; the same on every machine.
struct ParetoWork {
    double rounds = 0, wall_queries = 0, solves = 0;
};

/// One method at work on one wire.
class ParetoRunner {
public:
    virtual ~ParetoRunner() = default;
    /// Lets the method see the wire at rest, before a push. Not timed.
    virtual void remember(const physics::Chain&) {}
    virtual void start(const physics::Chain&) = 0;
    /// Works for so many rounds; true when it has ended of itself.
    virtual bool advance(int rounds) = 0;
    virtual const std::vector<geometry::Vec3>& joints() const = 0;
    virtual ParetoWork work() const = 0;
    /// Why it ended: "at rest", "stuck", "diverged", or "went on".
    virtual std::string end() const = 0;
};

enum class Family { Paper, Global, Classical };

struct ParetoMethod {
    std::string name;  // in tables and pictures
    Family family = Family::Paper;
    std::string look;    // of its line, for gnuplot
    std::string colour;  // of its label
    int first = 1, most_push = 1,
        most_cold = 1;         // rounds: until the first look, of a push, from the centreline
    bool newton = false;       // ends of itself after few rounds: never cut short
    std::string round, solve;  // what they are
    /// `distal`: most of a budget goes to the tip, as in the product, where the method can choose.
    std::function<std::unique_ptr<ParetoRunner>(const ParetoVessel&, bool distal)> make;
};

/// One method of relaxation by its word (run::parse_method).
ParetoMethod own_method(const std::string& word, const std::string& name);

/// Those whose lines stand in the pictures. Baselines need a vessel with a tube.
std::vector<ParetoMethod> pareto_methods(bool quick);
/// Settings of the rivals that were tried, to choose those above.
std::vector<ParetoMethod> rival_sweep(bool quick);

}  // namespace studies
