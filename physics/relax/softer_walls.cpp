#include "physics/relax/softer_walls.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

#include "physics/geometry/maths.h"

namespace physics {
namespace {

/// A wall with a fraction of its stiffness.
class SofterWall final : public LumenWall {
public:
    SofterWall(const LumenWall& wall, double fraction) : wall_(wall), fraction_(fraction) {
        assert(fraction > 0 && fraction < 1);
    }
    void rigid_contacts(std::span<const Vec3> joints, std::span<WallContact> contacts) const override {
        assert(joints.size() == contacts.size());
        wall_.rigid_contacts(joints, contacts);
        for (WallContact& c : contacts) c.soften(fraction_);
    }
    bool same_vessel(int a, int b) const override { return wall_.same_vessel(a, b); }

private:
    const LumenWall& wall_;
    double fraction_;
};

double stiffest(const ContactSet& contacts) {
    double stiffness = 0;
    for (const WallContact& c : contacts.contacts()) stiffness = std::max(stiffness, c.stiffness);
    return stiffness;
}

/// min C/λ² [N/mm].
double softest_joint(const Chain& wire) {
    double softest = std::numeric_limits<double>::max();
    for (int j = 0; j < wire.segments(); ++j)
        softest = std::min(softest, wire.spring_constant(j) / geometry::pow(wire.lengths[j + 1], 2));
    assert(softest > 0);
    return softest;
}

}  // namespace

Termination SofterWalls::run(Iterate& at, Chain& wire, const WallDescent& own, const DescentTask& task) {
    const double wall_stiffness = stiffest(own.contacts);
    assert(own.contacts.contacts().size() == wire.joints.size());
    assert(!under_way() || wire_.segments() == wire.segments());
    if (under_way())
        at.look_at(wire_);
    else
        start(at, wire, own);
    const int most = own.options.softening.most_passes * wire.segments();
    Termination end = Termination::Stuck;
    bool cut = false;  // by the call's budget
    for (;;) {
        const bool hardened = stiffness_ >= wall_stiffness;
        end = descend(at, own, task, wall_stiffness);
        cut = end == Termination::OutOfBudget && spent_ < most;
        assert(spent_ >= 0);
        if (cut || hardened) break;
        // The wall only gets harder, and the energy of the rest in it higher.
        if (!(at.energy < energy_)) break;
        stiffness_ *= own.options.softening.hardening;
        spent_ = 0;
    }
    const double mu = at.trust.mu();
    at.trust.reset();  // a prediction takes these gains
    // What is lower in the wall itself counts, at rest or not.
    if (!(stiffness_ >= wall_stiffness && reached(at, own) < energy_)) return give_up(at, wire, own, cut, mu);
    wire = std::move(wire_);
    forget();
    if (end == Termination::OutOfBudget) at.trust.set(mu);
    return end;
}

void SofterWalls::start(Iterate& at, const Chain& wire, const WallDescent& own) {
    assert(!under_way());
    at.open_window(wire, own.contacts, wire.segments());
    stiffness_ = softest_joint(wire);
    energy_ = at.energy;
    spent_ = 0;
    wire_ = wire;
    assert(under_way());
}

/// Descends in the wall as it now is; the iterate's energy is then that in it.
Termination SofterWalls::descend(Iterate& at, const WallDescent& own, const DescentTask& task,
                                 double wall_stiffness) {
    assert(under_way());
    const int n = wire_.segments(), before = own.report.updates;
    const int most = before + own.options.softening.most_passes * n - spent_;
    const DescentTask whole{std::min(task.most_updates, most), 0, n, task.tolerance, task.certifies};
    Termination end = Termination::Stuck;
    if (stiffness_ >= wall_stiffness) {
        rebuild_joints(wire_);
        own.contacts.update(wire_);
        end = Descent(at, wire_, own.contacts, own.options, true, whole, own.report, own.observer).run();
    } else {
        const SofterWall soft(own.wall, stiffness_ / wall_stiffness);
        ContactSet softened(soft);
        softened.reset(wire_);
        end = Descent(at, wire_, softened, own.options, true, whole, own.report, own.observer).run();
        at.open_window(wire_, softened, n);
        own.report.wall_queries += softened.queries();
    }
    assert(own.report.updates >= before);
    spent_ += own.report.updates - before;
    return end;
}

/// Energy in the wall itself [N·mm].
double SofterWalls::reached(Iterate& at, const WallDescent& own) const {
    assert(at.trust.mu() == 0);
    at.open_window(wire_, own.contacts, wire_.segments());
    return at.energy;
}

/// The wire stays where it was stuck. Where only the call's budget has ended, the next one goes on.
Termination SofterWalls::give_up(Iterate& at, Chain& wire, const WallDescent& own, bool cut, double mu) {
    assert(under_way());
    at.look_at(wire);
    own.contacts.update(wire);
    at.open_window(wire, own.contacts, wire.segments());
    own.report.gradient = at.model.terms().relative_gradient;
    if (cut) {
        at.trust.set(mu);
        return Termination::OutOfBudget;
    }
    forget();
    assert(!under_way());
    return Termination::Stuck;
}

}  // namespace physics
