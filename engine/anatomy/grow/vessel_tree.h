#pragma once
/// A vessel tree in two forms: as specified, by named branches through knots with radii, and as sampled for
/// the generator.

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/anatomy/grow/disease.h"
#include "engine/anatomy/grow/patient.h"
#include "physics/geometry/landmark.h"

namespace anatomy {

/// A place that a centreline passes through, and the lumen's radius there [mm].
struct VesselKnot {
    geometry::Vec3 place;
    double radius;
};

/// A vessel that a branch of several in a row consists of: aorta, common iliac, external iliac. It begins at
/// this knot of the branch and ends where the next one begins.
struct BranchPart {
    std::string name;
    std::size_t knot = 0;
};

struct BranchSpec {
    std::string name;
    std::string parent;  // empty for a root; the first is one
    double at = 0;       // where it starts on the parent's centreline, from that one's first sample [mm]
    std::vector<VesselKnot> knots;  // a root's in space, a child's relative to its start
    bool closed = false;            // ends in a dome instead of an open end
    // Where it ends on another branch listed before it, as communicating arteries do; empty for an end of its
    // own. The knots are then moved, the more the nearer to that end, to arrive there.
    std::string joins = {};
    double joins_at = 0;                 // along that branch [mm]
    std::vector<BranchPart> parts = {};  // in order; empty for a branch of one vessel
};

/// Length of the centreline from the first knot to each [mm].
std::vector<double> knot_arcs(const std::vector<VesselKnot>&);

/// Where a centreline through knots bends most for its lumen: the radius of the bend over that of the lumen,
/// and the inner knot nearest to it.
struct Bend {
    double ratio;
    std::size_t knot;
};
Bend tightest_bend(const std::vector<VesselKnot>&);

/// Lateral waves of a centreline, fading at both ends; `branch` is empty for all. `part`, where it is not
/// empty, names the parts of the branch that have them.
struct Tortuosity {
    std::string branch;
    double amplitude = 0, wavelength = 0;  // [mm]
    std::string part = {};
};

struct NamedTarget {
    std::string name, branch;
    double at = 0;  // along the centreline [mm]
};

struct VesselTreeSpec {
    std::string name;
    std::vector<BranchSpec> branches;  // parents before their children
    std::vector<NamedTarget> targets;
    std::vector<Tortuosity> tortuosities;
    std::vector<Stenosis> stenoses;
    std::vector<Aneurysm> aneurysms;
    std::vector<FusiformAneurysm> fusiform;
    std::vector<Occlusion> occlusions;
    std::vector<Dissection> dissections;
    std::optional<geometry::BodyPlace> body;  // where in the body the vessels are, when that is known
    std::optional<Patient> patient;           // whose vessels they are, when they are a preset's
};

/// A part of a branch, or several in a row, as authors name them: "LCIA", "LEIA+LCFA".
struct PartPlace {
    std::string name, branch;
    double start = 0, end = 0;  // along the branch [mm]
};
/// The single parts of all branches that have them, as the branches are grown: without diseases, which change
/// no place. Expects a spec without problems, whose branch names are whole.
std::vector<PartPlace> parts_of(const VesselTreeSpec&);

/// Gives everything that is placed on a part of a branch, which a name without the rest stands for where no
/// other branch has it, the whole name of the branch and the place along that: 20 mm along "LCIA" is
/// 172 mm along "aorta+LCIA", where the second begins at 152 mm. What is not found stays as it is, for
/// problems() to say. Throws InputError for a place beyond the part.
void complete_branch_names(VesselTreeSpec&);

struct SampledBranch {
    std::string name;
    int parent = -1, parent_sample = 0;  // a child starts at this sample of its parent
    geometry::Polyline points;           // equally far apart, about VesselTree::spacing [mm]
    std::vector<double> radii;           // [mm]
    bool closed = false;
    int exit = 0;        // first sample outside the parent's lumen; the last if none is
    int separation = 0;  // first sample whose lumen is well clear of the parent's; the last if none is
    int joined = -1, joined_sample = 0;  // it ends at this sample of that branch
    int entry = 0;     // last sample outside the joined lumen; the last of all where it joins none
    int approach = 0;  // last sample whose lumen is well clear of the joined one's; likewise
    std::vector<double> part_starts;  // of the spec's parts, along the branch [mm]

    double step() const { return (points[1] - points[0]).norm(); }  // between samples [mm]
    int sample_at(double arc) const;           // the sample nearest to this distance from the start [mm]
    geometry::Vec3 tangent(int sample) const;  // unit
    double length() const { return step() * static_cast<double>(points.size() - 1); }  // [mm]
    /// Unit vectors across the branch at every sample, transported along it without turning about it.
    std::vector<geometry::Vec3> across() const;
    /// The direction across the branch in which it bulges: away from the centre of its bend.
    geometry::Vec3 convex_side(int sample) const;
};

struct VesselTree {
    std::string name;
    std::vector<SampledBranch> branches;
    double spacing = 0;       // of samples [mm]
    double least_radius = 0;  // [mm]
    std::vector<CalciumDeposit> calcium;

    /// How many branches more than a tree has connect it: each closes a loop of vessels.
    int loops() const;
};

/// Walls nearer to each other than this cannot be separated by the generator's grid, or are drawn together
/// where a branch of this radius leaves its parent [mm].
double least_gap(const VesselTree&, double radius);

/// The branch extended straight beyond its own open ends by twice its radius there; `before` is the number of
/// samples this adds at its start.
SampledBranch extended(const SampledBranch&, int& before);

/// Everything that prevents the spec from being grown: names, numbers, places. Empty when it is fine.
std::vector<std::string> problems(const VesselTreeSpec&);

/// Everything wrong with a grown tree: branches that bend tighter than their radius, leave no lumen or run
/// through one another. Empty when it is fine.
std::vector<std::string> problems(const VesselTree&);

/// Where parts of the branch lie on it, one or several in a row, "LCIA" or "LEIA+LCFA" [mm]; empty for other
/// names.
std::optional<std::pair<double, double>> extent_of(std::string_view part, const BranchSpec&,
                                                   const SampledBranch&);

/// A tree without branches, with the spacing that those of the spec ask for.
VesselTree seedling(const VesselTreeSpec&);
/// Samples one of them, with its waves, onto what it starts from and ends on. Throws InputError for a place
/// that is not on these.
void add_branch(VesselTree&, const BranchSpec&, const std::vector<Tortuosity>&);
/// Samples the branches and applies the modifiers. Throws InputError with the problems of spec or tree.
VesselTree grow(const VesselTreeSpec&);

/// The name of vessels grown from a preset or file with that seed: "arch-2-7"; that of both for seed 0.
std::string name_of_grown(const std::string& source, std::uint64_t seed);

}  // namespace anatomy
