#include "engine/studies/segment_terms.h"

#include <algorithm>

#include "physics/wire/bending.h"
#include "physics/wire/energy.h"

namespace studies {

int SegmentTerms::touching_between(int i, int j) const {
    return static_cast<int>(std::lower_bound(touching.begin(), touching.end(), j) -
                            std::lower_bound(touching.begin(), touching.end(), i));
}

SegmentTerms segment_terms(const PaperScene& scene, const physics::Chain& wire) {
    const int n = wire.segments();
    const auto contacts = physics::all_contacts(wire, *scene.wall);
    const auto directors = physics::directors(wire);
    std::vector<double> torque;
    physics::frame_torque(wire, directors, torque);
    SegmentTerms terms;
    terms.pull.resize(static_cast<std::size_t>(n) + 1);
    terms.bending = terms.wall = std::vector<geometry::Mat3>(terms.pull.size());
    geometry::Vec3 push = geometry::Vec3::Zero();
    geometry::Mat3 stiffness = geometry::Mat3::Zero();
    for (int i = n; i >= 1; --i) {
        if (contacts[i].touches()) {
            push += contacts[i].push();
            stiffness += contacts[i].stiffness * contacts[i].normal * contacts[i].normal.transpose();
            terms.touching.push_back(i);
        }
        const auto bending = physics::bending_terms(wire, directors, torque, i);
        terms.pull[i] = bending.pull - wire.lengths[i] * push;
        terms.bending[i] = bending.curvature;
        terms.wall[i] = wire.lengths[i] * wire.lengths[i] * stiffness;
    }
    std::reverse(terms.touching.begin(), terms.touching.end());
    return terms;
}

}  // namespace studies
