#pragma once
/// Small vessel trees that several tests grow.

#include "engine/anatomy/grow/generator.h"
#include "engine/anatomy/scenes.h"

namespace test {

/// A straight vessel of radius 2 along +x with a branch of radius 1.2 to the side: 30 mm and 14 mm.
inline anatomy::VesselTreeSpec small_tree() {
    anatomy::VesselTreeSpec spec;
    spec.name = "small";
    spec.branches = {{"main", "", 0, {{{0, 0, 0}, 2}, {{15, 0, 0}, 2}, {{30, 0, 0}, 1.8}}, false},
                     {"side", "main", 12, {{{0, 0, 0}, 1.2}, {{3, 4, 0}, 1.2}, {{8, 11, 2}, 1}}, false}};
    spec.targets = {{"far", "side", 9}};
    return spec;
}

inline anatomy::Anatomy straight_tube(const char* name) {
    return anatomy::tube_anatomy(name, anatomy::draw(std::vector<anatomy::PenMove>{anatomy::Run{40}}), 2.0,
                                 24, 1.0);
}

inline const anatomy::Anatomy& small_anatomy() {
    static const anatomy::Anatomy small = anatomy::generate(small_tree());
    return small;
}

}  // namespace test
