#pragma once
/// Small vessel trees as centrelines and ends alone, for tests that need no wall.

#include <string>
#include <string_view>

#include "engine/anatomy/anatomy.h"
#include "engine/anatomy/grow/vessel_presets.h"
#include "engine/anatomy/grow/vessel_tree.h"

namespace test {

/// Straight, with a sample every mm at least; a child starts at its parent's sample nearest to `from`.
inline void add_branch(anatomy::Anatomy& anatomy, const std::string& name, int parent,
                       const geometry::Vec3& from, const geometry::Vec3& to, double radius) {
    geometry::CentrelineBranch branch;
    branch.name = name;
    branch.parent = parent;
    const int steps = static_cast<int>(std::ceil((to - from).norm()));
    for (int i = 0; i <= steps; ++i) {
        branch.points.push_back(from + (to - from) * i / steps);
        branch.radii.push_back(radius);
    }
    if (parent >= 0) {
        const geometry::Polyline& line = anatomy.branches[parent].points;
        branch.parent_sample = 0;
        for (std::size_t i = 0; i < line.size(); ++i)
            if ((line[i] - from).norm() < (line[branch.parent_sample] - from).norm())
                branch.parent_sample = static_cast<int>(i);
    }
    anatomy.branches.push_back(branch);
}

inline void add_end(anatomy::Anatomy& anatomy, const std::string& name, const geometry::Vec3& centre,
                    const geometry::Vec3& outward, double radius,
                    anatomy::EndRole role = anatomy::EndRole::Outlet) {
    anatomy.ends.push_back({{name, centre, outward, radius}, role});
}

/// Down from z = 0 by `length`, open at both ends: "vessel.in" above, "vessel.out" below.
inline anatomy::Anatomy straight_vessel(double length, double radius) {
    anatomy::Anatomy anatomy;
    anatomy.name = "straight";
    add_branch(anatomy, "vessel", -1, {0, 0, 0}, {0, 0, -length}, radius);
    add_end(anatomy, "vessel.in", {0, 0, 0}, {0, 0, 1}, radius, anatomy::EndRole::Inlet);
    add_end(anatomy, "vessel.out", {0, 0, -length}, {0, 0, -1}, radius * 0.999);
    return anatomy;
}

/// An aorta of radius 9 from z = 100 down to 0 with ends of radius 9 and 7, a renal artery of 3 to the left
/// from z = 50 and a mesenteric artery of 2 forward from z = 70, each 50 mm long.
inline anatomy::Anatomy small_abdomen() {
    anatomy::Anatomy anatomy;
    anatomy.name = "abdomen";
    add_branch(anatomy, "trunk", -1, {0, 0, 100}, {0, 0, 0}, 9);
    add_branch(anatomy, "LRA", 0, {0, 0, 50}, {50, 0, 50}, 3);
    add_branch(anatomy, "SMA", 0, {0, 0, 70}, {0, -50, 70}, 2);
    add_end(anatomy, "trunk.in", {0, 0, 100}, {0, 0, 1}, 9, anatomy::EndRole::Inlet);
    add_end(anatomy, "trunk.out", {0, 0, 0}, {0, 0, -1}, 7);
    add_end(anatomy, "LRA.out", {50, 0, 50}, {1, 0, 0}, 3);
    add_end(anatomy, "SMA.out", {0, -50, 70}, {0, -1, 0}, 2);
    return anatomy;
}

/// The centrelines of vessels as they are grown, without their surface.
inline anatomy::Anatomy grown(const anatomy::VesselTreeSpec& spec) {
    const anatomy::VesselTree tree = anatomy::grow(spec);
    anatomy::Anatomy anatomy;
    anatomy.name = spec.name;
    for (const anatomy::SampledBranch& branch : tree.branches)
        anatomy.branches.push_back(
            {branch.name, branch.parent, branch.parent_sample, branch.points, branch.radii});
    return anatomy;
}
inline anatomy::Anatomy grown(std::string_view preset) {
    return grown(anatomy::vessel_preset(preset));
}

}  // namespace test
