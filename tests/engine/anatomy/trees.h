#pragma once
/// Small vessel trees that several tests grow.

#include "engine/anatomy/generator.h"
#include "engine/scenes.h"

namespace engine::test {

/// A straight vessel of radius 2 along +x with a branch of radius 1.2 to the side: 30 mm and 14 mm.
inline VesselTreeSpec small_tree() {
    VesselTreeSpec spec;
    spec.name = "small";
    spec.branches = {{"main", "", 0, {{{0, 0, 0}, 2}, {{15, 0, 0}, 2}, {{30, 0, 0}, 1.8}}, false},
                     {"side", "main", 12, {{{0, 0, 0}, 1.2}, {{3, 4, 0}, 1.2}, {{8, 11, 2}, 1}}, false}};
    spec.targets = {{"far", "side", 9}};
    return spec;
}

inline Anatomy straight_tube(const char* name) {
    return tube_anatomy(name, draw(std::vector<PenMove>{Run{40}}), 2.0, 24, 1.0);
}

inline const Anatomy& small_anatomy() {
    static const Anatomy anatomy = generate(small_tree());
    return anatomy;
}

}  // namespace engine::test
