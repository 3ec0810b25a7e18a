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

/// The small tree with a second way round: a bypass that leaves the main vessel at 8 mm and comes back to it
/// at 24 mm.
inline anatomy::VesselTreeSpec small_loop() {
    anatomy::VesselTreeSpec spec = small_tree();
    spec.name = "loop";
    spec.branches.push_back(
        {"bypass",
         "main",
         7,
         {{{0, 0, 0}, 1}, {{2, -6, 0}, 1}, {{9, -9, 0}, 1}, {{15, -6, 0}, 1}, {{17, 0, 0}, 1}},
         false,
         "main",
         24});
    return spec;
}

/// Two vessels that flow together as the vertebral arteries do: "right" comes in by an end of its own and
/// ends on "left".
inline anatomy::VesselTreeSpec small_confluence() {
    anatomy::VesselTreeSpec spec;
    spec.name = "confluence";
    spec.branches = {
        {"left", "", 0, {{{0, 6, 0}, 1.8}, {{10, 2, 0}, 1.7}, {{20, 0, 0}, 1.7}, {{40, 0, 0}, 1.6}}, false},
        {"right", "", 0, {{{0, -6, 0}, 1.2}, {{10, -3, 0}, 1.2}, {{19, -0.5, 0}, 1.2}}, false, "left", 21}};
    spec.targets = {{"far", "left", 35}};
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
