#pragma once
/// What a mesh does not say of itself: names for its branches, ends and targets, how its numbers become
/// millimetres in the patient's frame, LPS, and where in the body it lies.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/anatomy/anatomy.h"
#include "engine/anatomy/import/given_centrelines.h"
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

/// Gives each branch the name of the line that runs along most of it, or of its last third; the branch's
/// target the same, and its end NAME.out, as generated vessels have it; the inlet is NAME.in. Then the ends
/// that the user names: an end takes that name as it is, its branch and target the same without .in or .out;
/// a branch from a named inlet to a named outlet is called INLET+OUTLET. Names that would repeat get a
/// number. Throws InputError for a place farther from every end than 3 of its radii, and for two names of one
/// end.
void give_names(Anatomy&, std::span<const GivenLine>, std::span<const NamedPlace>);

/// What a mesh file does not say of its own numbers.
struct FileFrame {
    double scale = 1;                    // after the unit
    std::string axes = "lps";            // or ras: x to the right, y to the front
    std::vector<std::string> rotations;  // "AXIS:DEG" about the origin, in this order, right-handed
};

/// From the file's numbers, in millimetres by its unit, to the patient's frame. Throws InputError.
geometry::Mat3 to_patient(const FileFrame&);

void transform(const geometry::Mat3&, std::vector<geometry::Vec3>& points);

/// pelvis and abdomen hang on the aortic bifurcation, chest on the aortic valve, head on the sella. Throws
/// InputError for another word.
geometry::Landmark landmark_of_part(const std::string& part);

/// Sets the anatomy's body: its landmark lies where the user says or, without that, where such vessels
/// usually have it. Returns what was assumed, a sentence for the report.
std::string place_in_part(Anatomy&, const std::string& part, const std::optional<geometry::Vec3>& landmark);

}  // namespace anatomy
