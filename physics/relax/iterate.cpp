#include "physics/relax/iterate.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "physics/geometry/maths.h"
#include "physics/wire/bending.h"

namespace physics {
namespace {

bool winds_up(const Chain& chain) {
    assert(!chain.devices.empty());
    return std::any_of(chain.devices.begin(), chain.devices.end(),
                       [](const Device& device) { return device.windup_stiffness > 0; });
}

}  // namespace

double Iterate::energy_scale() const {
    assert(load_scale >= 0);
    return std::abs(energy) + load_scale;
}

void Iterate::set_units(const Chain& wire, const ContactSet& contacts, const GlobalOptions& options) {
    assert(contacts.contacts().size() == wire.joints.size());
    const double unbounded = options.trust.unbounded;
    double stiffest = 0, room = unbounded;
    for (int j = 0; j < wire.segments(); ++j) stiffest = std::max(stiffest, wire.spring_constant(j));
    for (const WallContact& c : contacts.contacts())
        if (c.clearance > 0) room = std::min(room, c.clearance);
    const double length = wire.inserted_length() / wire.segments();
    assert(stiffest > 0 && room > 0 && length > 0);
    trust.set_unit(stiffest * length / geometry::pow(room < unbounded ? room : length, 4));
    model.least_pivot = options.saddle.pivot_fraction * stiffest;
    model.slips_on = options.step.slips_on;
    assert(model.least_pivot > 0);
}

void Iterate::linearise(const Chain& wire, const ContactSet& contacts, int first) {
    assert(first >= 1 && first <= wire.segments());
    if (winds_up(wire)) first = std::max(1, std::min(first, wire.segments() - wire.bent_segments()));
    pivots = model.linearise(wire, contacts, first, trust.mu());
    assert(model.stages() == wire.segments() && pivots.shifted >= 0);
}

void Iterate::measure_window(const Chain& wire, const ContactSet& contacts) {
    const int first = model.first();
    assert(first >= 1 && first <= wire.segments());
    energy = contacts.energy(wire.joints, first) + grip_energy(wire.grips, wire.joints, first);
    for (int j = first - 1; j < wire.segments(); ++j) energy += joint_energy(wire, model.directors, j);
    energy += coupling_energy(wire, first - 1) + twist_energy(wire, first);
    load_scale = contacts.load_scale(first);
    assert(load_scale >= 0);
}

void Iterate::open_window(const Chain& wire, const ContactSet& contacts, int segments) {
    assert(segments >= 1);
    linearise(wire, contacts, std::max(1, wire.segments() - segments + 1));
    model.sum_proximal(wire, contacts);
    measure_window(wire, contacts);
    assert(window(wire) >= std::min(segments, wire.segments()));
}

void Iterate::accept(Chain& wire, ContactSet& contacts, double trial_energy) {
    assert(std::isfinite(trial_energy) && contacts.contacts().size() == wire.joints.size());
    model.take(wire);
    contacts.commit();
    energy = trial_energy;
}

void Iterate::look_at(const Chain& wire) {
    if (wire.bent_segments() == 0) return;
    assert(model.directors.size() == wire.joints.size());
    model.directors[0] = wire.base_director;
    restore_frames(wire, 1);
}

void Iterate::restore_frames(const Chain& wire, int first) {
    assert(first >= 1);
    assert(model.directors.size() == wire.joints.size());
    transport_directors(wire, first, model.directors);
}

}  // namespace physics
