#pragma once
/// What a mesh does not say of itself: names for its branches, ends and targets, how its numbers become
/// millimetres in the patient's frame, LPS, and where in the body it lies.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/anatomy/anatomy.h"
#include "engine/anatomy/import/given_centrelines.h"
#include "engine/anatomy/import/mesh_repair.h"
#include "physics/geometry/vec.h"

namespace anatomy {

/// A name for the end nearest to a place.
struct NamedPlace {
    std::string name;
    geometry::Vec3 at;  // [mm]
};

/// "LCFA=12.5,-40,100". Throws InputError, also for names that are empty, longer than 60 bytes, or hold
/// control characters, quotes or backslashes.
NamedPlace parse_named_place(const std::string&);

/// Gives branches the names of the lines that run along them. A branch ends where a name ends: what follows
/// by another name, or by none for more than three radii, is a branch of its own, which starts at the last
/// sample of the one before. A branch's target has its name, and its end is NAME.out, as generated vessels
/// have it; the inlet is NAME.in. A line that runs along no branch for as long as the vessel is wide, or only
/// where another line runs farther, names a target on the branch that it runs along. Then the ends that the
/// user names: an end takes that name as it is, its branch and target the same without .in or .out; a branch
/// from a named inlet to a named outlet is called INLET+OUTLET. Names that would repeat get a number. Returns
/// which names became places, which were changed, and which were not used and why. Throws InputError for a
/// place farther from every end than 3 of its radii, and for two names of one end.
std::vector<Finding> give_names(Anatomy&, std::span<const GivenLine>, std::span<const NamedPlace>);

/// Makes targets of places in the lumen, in place of those that have the name already. Returns which were not
/// used.
std::vector<Finding> give_targets(Anatomy&, std::span<const NamedPlace>);

/// What a mesh file does not say of its own numbers.
struct FileFrame {
    double scale = 1;  // after the unit
    std::string axes;  // lps or ras (x to the right, y to the front); empty = as the file states
    std::vector<std::string> rotations;  // "AXIS:DEG" about the origin, in this order, right-handed
};

/// From the numbers of a file with these axes, in millimetres by its unit, to the patient's frame. Throws
/// InputError.
geometry::Mat3 to_patient(const FileFrame&, const std::string& axes = "lps");

void transform(const geometry::Mat3&, std::vector<geometry::Vec3>& points);

/// pelvis and abdomen hang on the aortic bifurcation, chest on the aortic valve, head on the sella. Throws
/// InputError for another word.
geometry::Landmark landmark_of_part(const std::string& part);

/// Sets the anatomy's body: its landmark lies where the user says or, without that, where such vessels
/// usually have it. Returns what was assumed, a sentence for the report.
std::string place_in_part(Anatomy&, const std::string& part, const std::optional<geometry::Vec3>& landmark);

}  // namespace anatomy
