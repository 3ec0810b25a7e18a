#include "engine/room/way_map.h"

#include <algorithm>

namespace room {
namespace {

/// A stretch of a branch's centreline, from one sample to another, in either direction.
struct Stretch {
    int branch, from, to;
};

/// From the place up to the root of its tree.
std::vector<Stretch> path_up(const anatomy::Anatomy& anatomy, anatomy::VesselPlace place) {
    std::vector<Stretch> path;
    while (place.branch >= 0 && path.size() <= anatomy.branches.size()) {
        path.push_back({place.branch, place.sample, 0});
        const anatomy::CentrelineBranch& branch = anatomy.branches[place.branch];
        place = {branch.parent, branch.parent_sample, 0};
    }
    return path;
}

/// From one place to the other, over the branch that both are below.
geometry::Polyline path_between(const anatomy::Anatomy& anatomy, const anatomy::VesselPlace& start,
                                const anatomy::VesselPlace& target) {
    const std::vector<Stretch> up = path_up(anatomy, start), down = path_up(anatomy, target);
    std::vector<Stretch> path;
    for (const Stretch& of_start : up) {
        const auto meets = std::find_if(down.begin(), down.end(), [&](const Stretch& stretch) {
            return stretch.branch == of_start.branch;
        });
        if (meets == down.end()) {
            path.push_back(of_start);
            continue;
        }
        path.push_back({of_start.branch, of_start.from, meets->from});
        for (auto stretch = meets; stretch != down.begin();) {
            --stretch;
            path.push_back({stretch->branch, 0, stretch->from});
        }
        geometry::Polyline points;
        for (const Stretch& stretch : path) {
            const auto& line = anatomy.branches[stretch.branch].points;
            const int step = stretch.to >= stretch.from ? 1 : -1;
            for (int i = stretch.from; i != stretch.to + step; i += step) points.push_back(line[i]);
        }
        return points;
    }
    return {};
}

}  // namespace

geometry::Vec3 target_of(const scenario::Target& target, const anatomy::Anatomy& anatomy) {
    for (const anatomy::VesselTarget& known : anatomy.targets)
        if (known.name == target.name) return known.centre;
    return target.centre.value_or(geometry::Vec3::Zero());
}

WayMap way_map(const scenario::Scenario& s, const anatomy::Anatomy& anatomy, const render::CArm& arm) {
    const render::ArmAxes axes = render::axes(arm);
    const auto flat = [&](const geometry::Vec3& p) {
        return WayMap::Point{axes.right.dot(p), -axes.up.dot(p)};
    };
    const geometry::Vec3 target = target_of(s.target, anatomy);
    geometry::Vec3 start = geometry::Vec3::Zero();
    for (const anatomy::VesselEnd& end : anatomy.ends)
        if (end.opening.name == s.entry.end) start = end.opening.centre;

    WayMap map;
    map.start = flat(start);
    map.target = flat(target);
    map.radius = s.target.radius;
    for (const geometry::Vec3& p : path_between(anatomy, anatomy::nearest_place(anatomy, start),
                                                anatomy::nearest_place(anatomy, target)))
        map.way.push_back(flat(p));
    for (const anatomy::CentrelineBranch& branch : anatomy.branches) {
        WayMap::Branch& drawn = map.vessels.emplace_back();
        for (const geometry::Vec3& p : branch.points) drawn.points.push_back(flat(p));
        drawn.radii.assign(branch.radii.begin(), branch.radii.end());
    }
    map.low = map.high = map.target;
    const auto cover = [&](const WayMap::Point& p) {
        map.low = {std::min(map.low.x, p.x), std::min(map.low.y, p.y)};
        map.high = {std::max(map.high.x, p.x), std::max(map.high.y, p.y)};
    };
    cover(map.start);
    for (const WayMap::Point& p : map.way) cover(p);
    const double margin = 0.12 * std::max(map.high.x - map.low.x, map.high.y - map.low.y) + 15;
    map.low = {map.low.x - margin, map.low.y - margin};
    map.high = {map.high.x + margin, map.high.y + margin};
    return map;
}

}  // namespace room
