#include "physics/relax/newton_terms.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "physics/relax/riccati_recursion.h"
#include "physics/wire/bending.h"

namespace physics {
namespace {

/// Two unit vectors ⟂ u and each other, without roots and without comparisons: T. Duff et al., Building an
/// orthonormal basis, revisited (2017).
[[gnu::always_inline]] inline void turn_basis(const Vec3& u, Mat32& t) {
    const double sign = std::copysign(1.0, u[2]), r = -1 / (sign + u[2]), xy = u[0] * u[1] * r;
    t << 1 + sign * u[0] * u[0] * r, xy, sign * xy, sign + u[1] * u[1] * r, -sign * u[0], -u[1];
    assert((t.transpose() * t - Mat2::Identity()).norm() < 1e-6 && (t.transpose() * u).norm() < 1e-6);
}

/// Blocks of a joint that is straight at rest: f(κ), κ = u_i·u_j.
[[gnu::always_inline]] inline void straight_joint(double c, const Vec3& ui, const Mat32& ti, const Vec3& uj,
                                                  RiccatiStage& s) {
    const Mat32& tj = s.basis;
    const double kappa = ui.dot(uj), slope = -c * (7 - kappa) / 6, curve = c / 6, own = -slope * kappa;
    assert(std::abs(kappa) < 1 + 1e-9);
    const double a0 = ti.col(0).dot(uj), a1 = ti.col(1).dot(uj);
    const double b0 = tj.col(0).dot(ui), b1 = tj.col(1).dot(ui);
    s.slope_prev << slope * a0, slope * a1;
    s.slope << slope * b0, slope * b1;
    const double ca0 = curve * a0, ca1 = curve * a1, cb0 = curve * b0, cb1 = curve * b1;
    s.prev_prev << ca0 * a0 + own, ca0 * a1, ca0 * a1, ca1 * a1 + own;
    s.own << cb0 * b0 + own, cb0 * b1, cb0 * b1, cb1 * b1 + own;
    s.cross << slope * ti.col(0).dot(tj.col(0)) + ca0 * b0, slope * ti.col(0).dot(tj.col(1)) + ca0 * b1,
        slope * ti.col(1).dot(tj.col(0)) + ca1 * b0, slope * ti.col(1).dot(tj.col(1)) + ca1 * b1;
}

/// Adds the blocks of a joint of one device with rest angle β: κ = m·u_j, m = cos β u_i + sin β d, which also
/// turns with the device's frame.
void add_curved_joint(double c, const RestBend& rest, const Vec3& ui, const Mat32& ti, const Vec3& uj,
                      RiccatiStage& s, FrameStage& f) {
    assert(c > 0 && std::abs(rest.direction.dot(ui)) < 1e-6);
    const double cb = rest.cosine, sb = rest.sine;
    const Vec3& d = rest.direction;
    const Vec3 m = cb * ui + sb * d, aside = ui.cross(d);
    const double kappa = m.dot(uj), slope = -c * (7 - kappa) / 6, curve = c / 6;
    const Vec2 di = ti.transpose() * d, vi = ti.transpose() * uj, ci = ti.transpose() * aside;
    const double along = ui.dot(uj);
    const Vec2 a = cb * vi - sb * along * di;  // dκ/dα_i
    const Vec2 b = s.basis.transpose() * m;    // dκ/dα_j
    const double w = sb * aside.dot(uj);       // dκ/dψ
    Mat2 kappa_ii = -0.5 * sb * (di * vi.transpose() + vi * di.transpose());
    kappa_ii.diagonal().array() -= cb * along;
    const Mat2 kappa_ij = cb * ti.transpose() * s.basis - sb * di * (s.basis.transpose() * ui).transpose();
    s.slope_prev += slope * a;
    s.slope += slope * b;
    f.slope += slope * w;
    s.prev_prev += curve * a * a.transpose() + slope * kappa_ii;
    s.own += curve * b * b.transpose();
    s.own.diagonal().array() -= slope * kappa;
    s.cross += curve * a * b.transpose() + slope * kappa_ij;
    f.curve += curve * w * w - slope * sb * d.dot(uj);
    f.cross_prev += curve * w * a - slope * sb * along * ci;
    f.cross += curve * w * b + slope * sb * (s.basis.transpose() * aside);
}

/// Blocks of a joint: those of the devices that are straight there, as one, and of each that bends.
template <int F>
[[gnu::always_inline]] inline void chain_joint(const Chain& chain, const Frames& frames, int joint,
                                               double spring, const std::vector<Vec3>& directors,
                                               const Mat32& ti, RiccatiStage& s,
                                               [[maybe_unused]] FrameStage* frame) {
    assert(frames.count == F && spring > 0);
    const Vec3 &ui = chain.tangents[joint], &uj = chain.tangents[joint + 1];
    if constexpr (F == 0) {
        straight_joint(spring, ui, ti, uj, s);
    } else {
        const double whole = chain.rigidity[joint];
        double straight = whole;
        for (int f = 0; f < F; ++f) {
            const Device& device = chain.devices[frames.device[f]];
            if (device.rest[joint].angle != 0) straight -= device.rigidity[joint];
        }
        assert(straight > -1e-9 * whole);  // the devices that bend are no stiffer than all
        straight_joint(spring * (straight / whole), ui, ti, uj, s);
        for (int f = 0; f < F; ++f) {
            const Device& device = chain.devices[frames.device[f]];
            if (device.rest[joint].angle == 0) continue;
            add_curved_joint(spring * (device.rigidity[joint] / whole),
                             rest_bend(device, joint, ui, directors[joint]), ui, ti, uj, s, frame[f]);
        }
    }
}

/// Adds the couplings of joint `joint`, the last of those that are left.
void add_couplings(const Chain& chain, int joint, std::size_t& left, NewtonTerms& terms) {
    assert(left <= chain.couplings.size());
    const int count = terms.frames.count;
    for (; left > 0 && chain.couplings[left - 1].joint == joint; --left) {
        const Coupling& c = chain.couplings[left - 1];
        const CouplingTerms by = coupling_terms(chain, c);
        const int inner = terms.frames.of[c.inner], outer = terms.frames.of[c.outer];
        assert(inner >= 0 && inner < outer && outer < count);
        FrameStage *a = &terms.frame_stages[joint * count + inner],
                   *b = &terms.frame_stages[joint * count + outer];
        a->slope -= by.slope, b->slope += by.slope;
        a->curve += by.curve, b->curve += by.curve;
        terms.mixed[(joint * count + outer) * count + inner] -= by.curve;
    }
}

constexpr double same_force = 1e-9;  // of a contact's own: within this the model's force is that

/// Makes the twist of a segment by itself, of the frames that do, and what its joint's grip holds of it.
/// `place` is that of its joint from the introducer [mm].
void set_twists(const Chain& chain, int j, double place, NewtonTerms& terms) {
    assert(j >= 1 && j <= chain.segments() && terms.frames.each);
    for (int f = 0; f < terms.frames.count; ++f) {
        const Device& device = chain.devices[terms.frames.device[f]];
        if (!device.twists_by_segments()) continue;
        FrameStage& t = terms.frame_stages[(j - 1) * terms.frames.count + f];
        t.twist_stiffness = device.torsion[j];
        t.twist_slope = device.torsion[j] * (device.wound[j] - device.wound[j - 1]);
        assert(t.twist_stiffness > 0);
        t.grip_slope = t.grip_grip = 0;
        t.grip_cross.setZero();
    }
    if (!chain.grips.empty() && chain.grips[j].holds())
        set_held_twist(chain, j, place, {chain.grips[j], chain.joints[j]}, terms);
}

/// Adds one more segment to the sums. Returns |gradient|² over C².
template <int F>
[[gnu::always_inline]] inline double add_segment(const Chain& chain, int j, bool loaded, NewtonTerms& terms,
                                                 DistalSums& sums) {
    RiccatiStage& s = terms.stages[j - 1];
    assert(s.length > 0 && terms.inverse_spring[j - 1] > 0 && sums.length >= 0);
    [[maybe_unused]] const FrameStage* frame = F > 0 ? &terms.frame_stages[(j - 1) * F] : nullptr;
    double twist_square = 0;
    if (F > 0 && terms.frames.each)
        for (int f = 0; f < F; ++f) {
            sums.torque[f] += frame[f].grip_slope;
            if (frame[f].twist_stiffness == 0) continue;
            const double g = terms.frame_gradient[(j - 1) * F + f] = frame[f].twist_slope + sums.torque[f];
            twist_square = std::max(twist_square, g * g);
        }
    Vec2 g = s.slope + sums.slope;
    g.noalias() += s.length * (s.basis.transpose() * sums.force);
    sums.slope = s.slope_prev;
    if (loaded) sums.length += chain.length_of(j);
    if constexpr (F > 0) {
        double torque = 0;
        for (int f = 0; f < F; ++f) torque += sums.torque[f];
        g += torque * s.twist;
        sums.slope += torque * s.twist_prev;
        for (int f = 0; f < F; ++f) sums.torque[f] += frame[f].slope;
    }
    terms.gradient[j - 1] = g;
    const double inverse_spring = terms.inverse_spring[j - 1];
    return std::max(g.squaredNorm(), twist_square) * (inverse_spring * inverse_spring);
}

void set_axial(const Chain& chain, int j, bool loaded, double length, const Vec3& force, RiccatiStage& s) {
    assert(s.length == chain.lengths[j] && length >= 0);
    const Vec3& u = chain.tangents[j];
    s.axial = s.length * u.dot(force);
    if (loaded) s.axial -= s.length * length * u.dot(chain.load);
}

/// How the frames turn with the joint before segment j under this torque. The second-order twist of a joint
/// is half the area that its two tangents sweep against each other.
[[gnu::always_inline]] inline void set_transport(const Chain& chain, int j, const Mat32& prev, double torque,
                                                 RiccatiStage& s) {
    const Vec3 &ui = chain.tangents[j - 1], &uj = chain.tangents[j];
    assert(std::abs(ui.squaredNorm() - 1) < 1e-9 && std::abs(uj.squaredNorm() - 1) < 1e-9);
    const Vec3 turn = ui.cross(uj) / std::max(1e-9, 1 + ui.dot(uj));
    s.twist_prev = -(prev.transpose() * turn);
    s.twist = -(s.basis.transpose() * turn);
    if (torque == 0) return;
    const Vec3 axis = 0.5 * torque * (ui + uj).normalized();
    s.cross.col(0) += prev.transpose() * Vec3(s.basis.col(0)).cross(axis);
    s.cross.col(1) += prev.transpose() * Vec3(s.basis.col(1)).cross(axis);
}

/// The wall's terms of a stage, with the force of its plane, which becomes the contact's. Adds what the wall
/// bears, as the model has it, and its push. Returns whether both forces agree.
[[gnu::always_inline]] inline bool add_contact(const WallContact& contact, ContactPlane& plane,
                                               RiccatiStage& s, Vec3& borne, Vec3& push) {
    const double force = plane.force;
    s.touches = contact.touches() || force > 0;
    if (s.touches) {
        plane = {contact.penetration, contact.stiffness, contact.normal, force};
        s.force = contact.stiffness * contact.penetration * contact.normal + contact.stiffening_push();
        s.stiffness =
            contact.stiffness * contact.normal * contact.normal.transpose() + force * contact.curvature;
        borne += force * contact.normal;
        if (contact.touches()) push += s.force;
    }
    return !(std::abs(force - contact.force()) > same_force * contact.force());
}

/// From the tip to the window's base, a stage at a time.
template <int F>
RiccatiReport from_tip(const Chain& chain, std::span<const WallContact> contacts,
                       const std::vector<Vec3>& directors, int first, double mu, double least_pivot,
                       NewtonTerms& terms, std::span<ContactPlane> planes, std::span<RiccatiGain> gains,
                       [[maybe_unused]] std::vector<FrameGain>& frame_gains) {
    const int n = chain.segments();
    assert(planes.size() == chain.joints.size() && gains.size() == terms.stages.size());
    const bool loaded = !chain.load.isZero(0), gripped = !chain.grips.empty();
    DistalSums sums;
    Vec3 borne = Vec3::Zero();  // by the wall, as the model has it
    double largest = 0;
    [[maybe_unused]] double place = F > 0 && terms.frames.each ? chain.inserted_length() : 0;
    [[maybe_unused]] std::size_t couplings = chain.couplings.size();
    RiccatiRecursion<F> recursion(mu, least_pivot);
    Mat32 own, prev;
    turn_basis(chain.tangents[n], own);
    for (int j = n; j >= first; --j) {
        RiccatiStage& s = terms.stages[j - 1];
        turn_basis(chain.tangents[j - 1], prev);
        s.basis = own;
        s.length = chain.lengths[j];
        const double c = chain.spring_constant(j - 1);
        terms.inverse_spring[j - 1] = 1 / c;
        [[maybe_unused]] FrameStage* frame = nullptr;
        if constexpr (F > 0) {
            frame = &terms.frame_stages[(j - 1) * F];
            for (int f = 0; f < F; ++f) frame[f] = {};
        }
        chain_joint<F>(chain, terms.frames, j - 1, c, directors, prev, s, frame);
        if constexpr (F > 0) {
            if constexpr (F > 1) add_couplings(chain, j - 1, couplings, terms);
            if (terms.frames.each) set_twists(chain, j, place, terms);
            set_transport(chain, j, prev, j > first ? sums.whole_torque() : 0.0, s);
        }
        if (!add_contact(contacts[j], planes[j], s, borne, sums.force)) terms.exact = false;
        if (gripped && chain.grips[j].holds()) {
            if (!s.touches) planes[j] = {};
            const GripTerms grip(chain.grips[j], chain.joints[j]);
            add_grip(grip, s);
            borne += grip.drag;
            sums.force += grip.drag;
        }
        if (loaded)
            s.slope.noalias() -=
                s.length * (sums.length + chain.length_of(j)) * (s.basis.transpose() * chain.load);
        largest = std::max(largest, add_segment<F>(chain, j, loaded, terms, sums));
        set_axial(chain, j, loaded, sums.length, borne, s);
        recursion.add_wall(s);
        FrameGain* frame_gain = F > 0 ? &frame_gains[(j - 1) * F] : nullptr;
        if constexpr (F > 0) {
            if (terms.frames.each) recursion.twist_segment(s, j - first, frame, frame_gain);
            place -= s.length;
        }
        recursion.step(s, j - first, gains[j - 1], frame,
                       F > 1 && !terms.mixed.empty() ? &terms.mixed[(j - 1) * F * F] : nullptr, frame_gain);
        own = prev;
    }
    assert(couplings == 0 || chain.couplings[couplings - 1].joint < first - 1);
    terms.relative_gradient = std::sqrt(largest);
    terms.base = sums;
    return recursion.report();
}

/// What the introducer holds, from sums over the whole wire or over the window alone.
void hold(const Chain& chain, const DistalSums& sums, NewtonTerms& terms) {
    assert(sums.length >= 0);
    double carried = sums.length;
    // Half of the first segment's load is borne by the introducer itself.
    if (!chain.load.isZero(0) && chain.grid.end_cells == EndCells::Half) carried += chain.length_of(0);
    terms.push = sums.force - carried * chain.load;
    terms.torque = sums.whole_torque();
}

}  // namespace

Frames::Frames(const Chain& chain) {
    assert(!chain.devices.empty() && chain.devices.size() <= most_devices);
    of.fill(-1);
    for (std::size_t k = 0; k < chain.devices.size(); ++k) {
        if (!chain.devices[k].framed()) continue;
        each = each || chain.devices[k].twists_by_segments();
        device[count] = static_cast<int>(k);
        of[k] = count++;
    }
}

GripTerms::GripTerms(const Grip& grip, const Vec3& joint)
    : drag(grip.push(joint)), stiffness(grip.stiffness(joint)) {
    assert(grip.holds());
}

void add_grip(const GripTerms& grip, RiccatiStage& stage) {
    assert(!(grip.stiffness.trace() < 0));  // positive semidefinite
    if (stage.touches) {
        stage.force += grip.drag;
        stage.stiffness += grip.stiffness;
    } else {
        stage.touches = true;
        stage.force = grip.drag;
        stage.stiffness = grip.stiffness;
    }
}

void set_held_twist(const Chain& chain, int j, double place, const GripTerms& grip, NewtonTerms& terms) {
    const int owner = chain.outermost(place), frame = terms.frames.of[owner];
    if (!chain.devices[owner].twists_by_segments()) return;
    assert(frame >= 0);
    FrameStage& t = terms.frame_stages[(j - 1) * terms.frames.count + frame];
    const Vec3& around = chain.grips[j].around;
    t.grip_slope = grip.drag.dot(around);
    t.grip_cross = grip.stiffness * around;
    t.grip_grip = around.dot(t.grip_cross);
}

RiccatiReport assemble_and_solve(const Chain& chain, std::span<const WallContact> contacts,
                                 const std::vector<Vec3>& directors, int first, double mu, double least_pivot,
                                 NewtonTerms& terms, std::span<ContactPlane> planes,
                                 std::span<RiccatiGain> gains, std::vector<FrameGain>& frame_gains) {
    const int n = chain.segments();
    assert(first >= 1 && first <= n && contacts.size() == chain.joints.size() && mu >= 0);
    terms.first = first;
    terms.frames = Frames(chain);
    terms.exact = true;
    const std::size_t framed = static_cast<std::size_t>(n) * terms.frames.count;
    assert(framed == 0 || directors.size() == chain.joints.size());
    terms.stages.resize(n);
    terms.gradient.resize(n, Vec2::Zero());
    terms.inverse_spring.resize(n);
    terms.frame_stages.resize(framed);
    terms.frame_gradient.resize(terms.frames.each ? framed : 0);
    frame_gains.resize(framed);
    if (chain.couplings.empty())
        terms.mixed.clear();
    else
        terms.mixed.assign(framed * terms.frames.count, 0.0);
    if (first == 1) terms.proximal_gradient = 0;
    const RiccatiReport report = with_frames(terms.frames.count, [&](auto count) {
        return from_tip<count()>(chain, contacts, directors, first, mu, least_pivot, terms, planes, gains,
                                 frame_gains);
    });
    hold(chain, terms.base, terms);
    for (int f = 0; f < terms.frames.count; ++f) {
        const Device& device = chain.devices[terms.frames.device[f]];
        if (device.windup_stiffness == 0) continue;
        const double slope = std::abs(terms.base.torque[f] - device.windup_stiffness * device.windup);
        terms.relative_gradient = std::max(terms.relative_gradient, slope * terms.inverse_spring[n - 1]);
    }
    return report;
}

void update_slopes(const Chain& chain, std::span<const WallContact> contacts,
                   const std::vector<Vec3>& directors, NewtonTerms& terms) {
    const int n = chain.segments();
    const bool loaded = !chain.load.isZero(0), gripped = !chain.grips.empty();
    assert(terms.stages.size() == static_cast<std::size_t>(n));
    double carried = 0, place = terms.frames.each ? chain.inserted_length() : 0;
    std::size_t couplings = chain.couplings.size();
    with_frames(terms.frames.count, [&](auto frames) {
        constexpr int F = frames();
        for (int j = n; j >= terms.first; --j) {
            RiccatiStage& s = terms.stages[j - 1];
            RiccatiStage fresh;
            fresh.basis = s.basis;
            std::array<FrameStage, F> frame = {};
            Mat32 prev;
            turn_basis(chain.tangents[j - 1], prev);
            chain_joint<F>(chain, terms.frames, j - 1, chain.spring_constant(j - 1), directors, prev, fresh,
                           frame.data());
            s.slope = fresh.slope;
            s.slope_prev = fresh.slope_prev;
            for (int f = 0; f < F; ++f) terms.frame_stages[(j - 1) * F + f].slope = frame[f].slope;
            for (; couplings > 0 && chain.couplings[couplings - 1].joint == j - 1; --couplings) {
                const Coupling& c = chain.couplings[couplings - 1];
                const double slope = coupling_terms(chain, c).slope;
                terms.frame_stages[(j - 1) * F + terms.frames.of[c.inner]].slope -= slope;
                terms.frame_stages[(j - 1) * F + terms.frames.of[c.outer]].slope += slope;
            }
            if (terms.frames.each) {
                set_twists(chain, j, place, terms);
                place -= chain.lengths[j];
            }
            if (loaded) {
                carried += chain.length_of(j);
                s.slope.noalias() -= s.length * carried * (s.basis.transpose() * chain.load);
            }
            if (!s.touches) continue;
            s.force = contacts[j].push();
            if (gripped && chain.grips[j].holds()) s.force += chain.grips[j].push(chain.joints[j]);
        }
    });
    assert(couplings == 0 || chain.couplings[couplings - 1].joint < terms.first - 1);
}

void sum_proximal(const Chain& chain, std::span<const WallContact> contacts, NewtonTerms& terms) {
    assert(contacts.size() == chain.joints.size() && terms.first >= 1);
    const bool loaded = !chain.load.isZero(0), gripped = !chain.grips.empty();
    DistalSums sums = terms.base;
    double largest = 0, place = 0;
    if (terms.frames.each)
        for (int j = 1; j < terms.first; ++j) place += chain.lengths[j];
    with_frames(terms.frames.count, [&](auto count) {
        for (int j = terms.first - 1; j >= 1; --j) {
            RiccatiStage& s = terms.stages[j - 1];
            if (contacts[j].touches()) sums.force += contacts[j].push();
            if (gripped && chain.grips[j].holds()) sums.force += chain.grips[j].push(chain.joints[j]);
            if (terms.frames.each) {
                set_twists(chain, j, place, terms);
                place -= chain.lengths[j];
            }
            largest = std::max(largest, add_segment<count()>(chain, j, loaded, terms, sums));
            set_axial(chain, j, loaded, sums.length, sums.force, s);
        }
    });
    assert(std::abs(place) < 1e-6);  // at the introducer
    terms.proximal_gradient = std::sqrt(largest);
    hold(chain, sums, terms);
}

}  // namespace physics
