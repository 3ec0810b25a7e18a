#include "physics/relax/newton_terms.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "physics/relax/riccati_recursion.h"

namespace physics {
namespace {

/// Two unit vectors ⟂ u and each other, without roots and without comparisons: T. Duff et al., Building an
/// orthonormal basis, revisited (2017).
[[gnu::always_inline]] inline void turn_basis(const Vec3& u, Mat32& t) {
    const double sign = std::copysign(1.0, u[2]), r = -1 / (sign + u[2]), xy = u[0] * u[1] * r;
    t << 1 + sign * u[0] * u[0] * r, xy, sign * xy, sign + u[1] * u[1] * r, -sign * u[0], -u[1];
}

/// Blocks of a joint that is straight at rest: f(κ), κ = u_i·u_j.
[[gnu::always_inline]] inline void straight_joint(double c, const Vec3& ui, const Mat32& ti, const Vec3& uj,
                                                  RiccatiStage& s) {
    const Mat32& tj = s.basis;
    const double kappa = ui.dot(uj), slope = -c * (7 - kappa) / 6, curve = c / 6, own = -slope * kappa;
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

/// Blocks of a joint with rest angle β: κ = m·u_j, m = cos β u_i + sin β d, which also turns with the twist.
void curved_joint(double c, double beta, const Vec3& ui, const Vec3& d, const Mat32& ti, const Vec3& uj,
                  RiccatiStage& s) {
    const double cb = std::cos(beta), sb = std::sin(beta);
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
    s.slope_prev = slope * a;
    s.slope = slope * b;
    s.slope_twist = slope * w;
    s.prev_prev = curve * a * a.transpose() + slope * kappa_ii;
    s.own = curve * b * b.transpose();
    s.own.diagonal().array() -= slope * kappa;
    s.cross = curve * a * b.transpose() + slope * kappa_ij;
    s.twist_twist = curve * w * w - slope * sb * d.dot(uj);
    s.twist_cross_prev = curve * w * a - slope * sb * along * ci;
    s.twist_cross = curve * w * b + slope * sb * (s.basis.transpose() * aside);
}

/// Blocks of a joint of several devices: the sum of theirs, straight ones as one.
void coaxial_joint(const Guidewire& wire, int joint, const Vec3& director, const Mat32& ti, RiccatiStage& s) {
    const Vec3 &ui = wire.tangents[joint], &uj = wire.tangents[joint + 1];
    const double length = wire.length_of(joint);
    double straight = 0;
    for (const CoaxialDevice& device : wire.devices)
        if (device.bend[joint].isZero(0)) straight += device.rigidity[joint];
    straight_joint(straight / length, ui, ti, uj, s);
    s.slope_twist = s.twist_twist = 0;
    s.twist_cross_prev.setZero();
    s.twist_cross.setZero();
    s.second_slope = s.second_second = 0;
    s.second_cross_prev.setZero();
    s.second_cross.setZero();
    RiccatiStage own;
    own.basis = s.basis;
    for (const CoaxialDevice& device : wire.devices) {
        if (device.bend[joint].isZero(0)) continue;
        const RestBend rest = rest_bend(device, joint, ui, director);
        curved_joint(device.rigidity[joint] / length, rest.angle, ui, rest.way, ti, uj, own);
        s.slope_prev += own.slope_prev;
        s.slope += own.slope;
        s.prev_prev += own.prev_prev;
        s.own += own.own;
        s.cross += own.cross;
        s.slope_twist += own.slope_twist;
        s.twist_twist += own.twist_twist;
        s.twist_cross_prev += own.twist_cross_prev;
        s.twist_cross += own.twist_cross;
        if (&device != &wire.devices[1]) continue;
        s.second_slope = own.slope_twist;
        s.second_second = own.twist_twist;
        s.second_cross_prev = own.twist_cross_prev;
        s.second_cross = own.twist_cross;
    }
}

constexpr double same_force = 1e-9;  // of a contact's own: within this the model's force is that

/// Adds the twist of the segment by itself, and what its joint's grip holds of it; before add_segment().
void add_twist(const Guidewire& wire, int j, NewtonTerms& terms, DistalSums& sums) {
    TwistStage& t = terms.twist_stages[j - 1];
    sums.torque += set_twist_stage(wire, j, t);
    terms.twist_gradient[j - 1] = t.slope + sums.torque;
}

/// Adds one more segment to the sums. Returns |gradient|² over C².
[[gnu::always_inline]] inline double add_segment(const Guidewire& wire, int j, bool loaded,
                                                 NewtonTerms& terms, DistalSums& sums) {
    RiccatiStage& s = terms.stages[j - 1];
    Vec2 g = s.slope + sums.slope;
    g.noalias() += s.length * (s.basis.transpose() * sums.force);
    sums.slope = s.slope_prev;
    if (loaded) sums.length += wire.length_of(j);
    if (terms.twist) {
        g += sums.torque * s.twist;
        sums.slope += sums.torque * s.twist_prev;
        sums.torque += s.slope_twist;
        if (terms.second) sums.second_torque += s.second_slope;
    }
    terms.gradient[j - 1] = g;
    const double inverse_spring = terms.inverse_spring[j - 1];
    double square = g.squaredNorm();
    if (terms.each) square = std::max(square, terms.twist_gradient[j - 1] * terms.twist_gradient[j - 1]);
    return square * (inverse_spring * inverse_spring);
}

void set_axial(const Guidewire& wire, int j, bool loaded, double length, const Vec3& force, RiccatiStage& s) {
    const Vec3& u = wire.tangents[j];
    s.axial = s.length * u.dot(force);
    if (loaded) s.axial -= s.length * length * u.dot(wire.load);
}

/// From the tip to the window's base, a stage at a time.
template <Twist twist>
RiccatiReport from_tip(const Guidewire& wire, std::span<const WallContact> contacts,
                       const std::vector<Vec3>& directors, int first, double mu, double least_pivot,
                       NewtonTerms& terms, std::span<ContactPlane> planes, std::span<RiccatiGain> gains,
                       [[maybe_unused]] std::span<TwistGain> twist_gains) {
    constexpr bool with_twist = twist != Twist::None;
    const int n = wire.segments();
    const bool loaded = !wire.load.isZero(0), gripped = !wire.grips.empty();
    const bool coaxial = !wire.devices.empty();
    DistalSums sums;
    Vec3 borne = Vec3::Zero();  // by the wall, as the model has it
    double largest = 0;
    RiccatiRecursion<twist> recursion(mu, least_pivot);
    Mat32 own, prev;
    turn_basis(wire.tangents[n], own);
    for (int j = n; j >= first; --j) {
        RiccatiStage& s = terms.stages[j - 1];
        turn_basis(wire.tangents[j - 1], prev);
        s.basis = own;
        s.length = wire.lengths[j];
        const double c = wire.spring_constant(j - 1), beta = wire.rest_angle[j - 1];
        terms.inverse_spring[j - 1] = 1 / c;
        const Vec3 &ui = wire.tangents[j - 1], &uj = wire.tangents[j];
        if (coaxial) {
            coaxial_joint(wire, j - 1, with_twist ? directors[j - 1] : Vec3(Vec3::Zero()), prev, s);
        } else if (beta == 0) {
            straight_joint(c, ui, prev, uj, s);
            if constexpr (with_twist) {
                s.slope_twist = s.twist_twist = 0;
                s.twist_cross_prev.setZero();
                s.twist_cross.setZero();
            }
        } else {
            curved_joint(c, beta, ui, directors[j - 1], prev, uj, s);
        }
        if constexpr (with_twist) {
            const Vec3 turn = ui.cross(uj) / std::max(1e-9, 1 + ui.dot(uj));
            s.twist_prev = -(prev.transpose() * turn);
            s.twist = -(s.basis.transpose() * turn);
            // The second-order twist of a joint is half the area that its two tangents sweep against each
            // other.
            if (j > first && sums.torque != 0) {
                const Vec3 axis = 0.5 * sums.torque * (ui + uj).normalized();
                s.cross.col(0) += prev.transpose() * Vec3(s.basis.col(0)).cross(axis);
                s.cross.col(1) += prev.transpose() * Vec3(s.basis.col(1)).cross(axis);
            }
        }
        const WallContact& contact = contacts[j];
        s.touches = contact.touches();
        const double force = planes[j].force;
        if (std::abs(force - contact.force()) > same_force * contact.force()) terms.exact = false;
        s.touches |= force > 0;
        if (s.touches) {
            planes[j] = {contact.penetration, contact.stiffness, contact.normal, force};
            s.force = contact.stiffness * contact.penetration * contact.normal + contact.stiffening_push();
            s.stiffness =
                contact.stiffness * contact.normal * contact.normal.transpose() + force * contact.curvature;
            borne += force * contact.normal;
            if (contact.touches()) sums.force += s.force;
        }
        if (gripped && wire.grips[j].holds()) {
            if (!s.touches) planes[j] = {};
            const Vec3 drag = add_grip(wire.grips[j], wire.joints[j], s);
            borne += drag;
            sums.force += drag;
        }
        if (loaded)
            s.slope.noalias() -=
                s.length * (sums.length + wire.length_of(j)) * (s.basis.transpose() * wire.load);
        if constexpr (twist == Twist::Each) add_twist(wire, j, terms, sums);
        largest = std::max(largest, add_segment(wire, j, loaded, terms, sums));
        set_axial(wire, j, loaded, sums.length, borne, s);
        recursion.add_wall(s);
        if constexpr (twist == Twist::Each)
            recursion.twist_segment(s, terms.twist_stages[j - 1], j - first, twist_gains[j - first]);
        recursion.step(s, j - first, gains[j - first]);
        own = prev;
    }
    terms.relative_gradient = std::sqrt(largest);
    terms.base = sums;
    return recursion.report();
}

/// What the introducer holds, from sums over the whole wire or over the window alone.
void hold(const Guidewire& wire, const DistalSums& sums, NewtonTerms& terms) {
    double carried = sums.length;
    // Half of the first segment's load is borne by the introducer itself.
    if (!wire.load.isZero(0) && wire.spec.end_cells == EndCells::Half) carried += wire.length_of(0);
    terms.push = sums.force - carried * wire.load;
    terms.torque = sums.torque;
}

}  // namespace

double set_twist_stage(const Guidewire& wire, int j, TwistStage& t) {
    t = {.stiffness = wire.torsion[j], .slope = wire.torsion[j] * wire.twists[j]};
    if (wire.grips.empty() || !wire.grips[j].holds()) return 0;
    const Grip& grip = wire.grips[j];
    t.grip_slope = grip.push(wire.joints[j]).dot(grip.around);
    t.grip_cross = grip.stiffness(wire.joints[j]) * grip.around;
    t.grip_grip = grip.around.dot(t.grip_cross);
    return t.grip_slope;
}

Vec3 add_grip(const Grip& grip, const Vec3& joint, RiccatiStage& stage) {
    const Vec3 drag = grip.push(joint);
    if (stage.touches) {
        stage.force += drag;
        stage.stiffness += grip.stiffness(joint);
    } else {
        stage.touches = true;
        stage.force = drag;
        stage.stiffness = grip.stiffness(joint);
    }
    return drag;
}

RiccatiReport assemble_and_solve(const Guidewire& wire, std::span<const WallContact> contacts,
                                 const std::vector<Vec3>& directors, int first, double mu, double least_pivot,
                                 NewtonTerms& terms, std::span<ContactPlane> planes,
                                 std::span<RiccatiGain> gains, std::span<TwistGain> twist_gains) {
    const int n = wire.segments();
    terms.first = first;
    terms.twist = wire.bent_segments() > 0;
    terms.exact = true;
    terms.each = !wire.twists.empty();
    if (terms.each) {
        terms.twist_stages.resize(n);
        terms.twist_gradient.resize(n);
    }
    terms.stages.resize(n);
    terms.gradient.resize(n, Vec2::Zero());
    terms.inverse_spring.resize(n);
    if (first == 1) terms.proximal_gradient = 0;
    terms.device_stiffness.clear();
    for (const CoaxialDevice& device : wire.devices)
        terms.device_stiffness.push_back(windup_stiffness(device));
    terms.second = terms.twist && wire.devices.size() == 2 &&
                   (terms.device_stiffness[0] > 0 || terms.device_stiffness[1] > 0);
    const auto solve = [&](auto which) {
        return from_tip<which()>(wire, contacts, directors, first, mu, least_pivot, terms, planes, gains,
                                 twist_gains);
    };
    const RiccatiReport report =
        terms.twists() == Twist::None  ? solve(std::integral_constant<Twist, Twist::None>())
        : terms.twists() == Twist::One ? solve(std::integral_constant<Twist, Twist::One>())
        : terms.twists() == Twist::Two ? solve(std::integral_constant<Twist, Twist::Two>())
                                       : solve(std::integral_constant<Twist, Twist::Each>());
    hold(wire, terms.base, terms);
    for (std::size_t k = 0; k < wire.devices.size(); ++k) {
        const double stiffness = terms.device_stiffness[k];
        if (stiffness == 0) continue;
        const double slope =
            std::abs(terms.device_torque(static_cast<int>(k)) - stiffness * wire.devices[k].windup);
        terms.relative_gradient = std::max(terms.relative_gradient, slope * terms.inverse_spring[n - 1]);
    }
    terms.windup_stiffness = wire.windup_stiffness();
    if (terms.windup_stiffness > 0) {
        const double slope = std::abs(terms.base.torque - terms.windup_stiffness * wire.windup);
        terms.relative_gradient = std::max(terms.relative_gradient, slope * terms.inverse_spring[n - 1]);
    }
    return report;
}

void sum_proximal(const Guidewire& wire, std::span<const WallContact> contacts, NewtonTerms& terms) {
    const bool loaded = !wire.load.isZero(0), gripped = !wire.grips.empty();
    DistalSums sums = terms.base;
    double largest = 0;
    for (int j = terms.first - 1; j >= 1; --j) {
        RiccatiStage& s = terms.stages[j - 1];
        if (contacts[j].touches()) sums.force += contacts[j].push();
        if (gripped && wire.grips[j].holds()) sums.force += wire.grips[j].push(wire.joints[j]);
        if (terms.each) add_twist(wire, j, terms, sums);
        largest = std::max(largest, add_segment(wire, j, loaded, terms, sums));
        set_axial(wire, j, loaded, sums.length, sums.force, s);
    }
    terms.proximal_gradient = std::sqrt(largest);
    hold(wire, sums, terms);
}

}  // namespace physics
