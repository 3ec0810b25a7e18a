#pragma once
/// What ails vessels: narrowings, calcium, aneurysms, occlusions, dissections. Branches are named as in the
/// spec, places are along their centrelines.

#include <string>
#include <vector>

#include "engine/anatomy/anatomy.h"
#include "engine/io/error.h"

namespace anatomy {

struct BranchSpec;
struct SampledBranch;

/// A narrowing, smooth over its length; `at` is its middle.
struct Stenosis {
    std::string branch;
    double at = 0, length = 0;  // [mm]
    double percent = 0;         // of the diameter, lost in the middle
    double eccentricity = 0;    // 0: from all sides; 1: from one, while the wall opposite stays [-]
    double angle = 0;           // of the plaque's side about the branch, from its most convex side [rad]
    bool calcified = false;     // deposits of calcium in the plaque, which the image shows
    io::TextPlace asked = {};   // where a file asks for it
};

/// The most that a lumen's radius may change along it [-]; at 1 one ball of it would contain the next.
inline constexpr double steepest_taper = 0.8;

/// A sac on the side of a branch, joined to it by a neck: a closed branch of its own.
struct Aneurysm {
    std::string branch;
    double at = 0;        // [mm]
    double diameter = 0;  // of the sac [mm]
    double neck = 0;      // its diameter where it leaves the branch [mm]
    double angle = 0;     // about the branch, from its most convex side [rad]
};

/// A widening of the whole branch, smooth over its length; `at` is its middle.
struct FusiformAneurysm {
    std::string branch;
    double at = 0, length = 0;  // [mm]
    double diameter = 0;        // in the middle [mm]
};

/// The branch ends there in a blunt stump; what leaves it beyond is gone.
struct Occlusion {
    std::string branch;
    double at = 0;  // [mm]
};

/// A flap divides the branch, from an entry tear at its start to a second tear at its end, into a true lumen,
/// which keeps the branch's name, and a false one, "BRANCH false lumen", that leaves the branch and comes
/// back to it. Both are round. No branch may leave in between.
struct Dissection {
    std::string branch;
    double at = 0, length = 0;   // of the entry tear, and of the flap [mm]
    double true_fraction = 0.4;  // of the true lumen's diameter in the sum of both
    double flap = 2.5;           // its thickness [mm]
    double angle = 0;            // of the true lumen's side, from the branch's most convex side [rad]
};

void narrow(SampledBranch&, const Stenosis&);
void widen(SampledBranch&, const FusiformAneurysm&);
/// Cuts the branch off behind the place.
void occlude(SampledBranch&, const Occlusion&);

/// Deposits in the plaque of a branch before it is narrowed; the same every time.
std::vector<CalciumDeposit> calcium_in(const SampledBranch&, const Stenosis&);

/// The sac, which meets its neck where the sphere is as wide as the neck, at the branch's wall.
BranchSpec sac(const Aneurysm&, const SampledBranch& parent);

/// Moves the branch into its true lumen, and returns the false one.
BranchSpec dissect(SampledBranch&, const Dissection&);

}  // namespace anatomy
