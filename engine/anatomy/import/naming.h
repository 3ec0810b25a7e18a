#pragma once
/// Names for the branches, ends and targets of an imported lumen.

#include <span>

#include "engine/anatomy/anatomy.h"
#include "engine/anatomy/import/given_centrelines.h"

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

}  // namespace anatomy
