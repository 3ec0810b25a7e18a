#include "engine/anatomy/behind_ends.h"

#include <algorithm>

namespace anatomy {

double ball_behind(const geometry::MeshQuery& wall, const geometry::Vec3& centre,
                   const geometry::Vec3& outward, double radius) {
    double largest = 0;
    for (double depth = 0.25; depth <= 2; depth += 0.25)
        largest = std::max(largest, wall.distance(centre - depth * radius * outward));
    return largest;
}

VesselPlace place_behind(const Anatomy& anatomy, const geometry::OpenEnd& end, double way) {
    VesselPlace place = nearest_place(anatomy, end.centre);
    const geometry::Polyline& line = anatomy.branches[place.branch].points;
    const int last = static_cast<int>(line.size()) - 1, step = place.sample > last / 2 ? -1 : 1;
    int& at = place.sample;
    for (double passed = 0; passed < way && at + step >= 0 && at + step <= last; at += step)
        passed += (line[at + step] - line[at]).norm();
    return place;
}

}  // namespace anatomy
