#include "engine/exercise/chain.h"

#include "physics/wire/friction.h"

namespace exercise {

physics::DeviceSpec spec_of(const scenario::Scenario& s, const scenario::Device& device) {
    physics::DeviceSpec spec = device;
    spec.friction *= s.wall_friction;
    spec.static_friction *= s.wall_friction;
    return spec;
}

namespace {

bool twists_from_the_start(const scenario::Scenario& s) {
    return s.torsion == scenario::TorsionModel::Compliant || s.torsion == scenario::TorsionModel::Segments;
}

}  // namespace

physics::Chain chain_of(const scenario::Scenario& s, std::span<const scenario::PlacedDevice> devices,
                        const geometry::Polyline& path, const physics::Chain* before) {
    std::vector<physics::Device> placed(devices.size());
    for (std::size_t k = 0; k < devices.size(); ++k) {
        physics::Device& device = placed[k];
        device.spec = spec_of(s, devices[k].device);
        device.inserted = devices[k].inserted;
        device.roll = devices[k].roll;
        const bool twisted = before && before->devices[k].spec.twists();
        if (!twists_from_the_start(s) && !twisted) physics::stiffen(device.spec);
        device.outside = s.relaxer.kind == physics::RelaxerKind::Global ? s.hand_distance : 0;
        if (!before) continue;
        const physics::Device& was = before->devices[k];
        device.inserted = was.inserted;
        device.outside = was.outside;
        device.roll = was.angle_at(before->segments());
        device.windup = was.wound_up();
    }
    physics::Chain chain = physics::chain_along(std::move(placed), {s.segment_length}, path);
    if (before) {
        chain.tangents[0] = before->tangents[0];
        chain.base_director = before->base_director;
    }
    return chain;
}

void exchange(physics::Chain& chain, int device, const scenario::Scenario& s, const scenario::Device& by) {
    physics::Device& placed = chain.devices[device];
    placed = {};
    placed.outside = s.hand_distance;
    placed.spec = spec_of(s, by);
    if (!twists_from_the_start(s)) physics::stiffen(placed.spec);
    physics::assign(chain);
    if (chain.grips.empty()) physics::start_grips(chain);
    std::erase_if(chain.rubs,
                  [&](const physics::Rub& rub) { return rub.inner == device || rub.outer == device; });
    physics::start_rubs(chain);
}

}  // namespace exercise
