#include "physics/newton_terms.h"

#include <algorithm>
#include <cmath>

namespace physics {
namespace {

/// Blocks of a joint that is straight at rest: f(κ), κ = u_i·u_j.
void straight_joint(double c, const Vec3& ui, const Mat32& ti, const Vec3& uj, RiccatiStage& s) {
    const double kappa = ui.dot(uj), slope = -c * (7 - kappa) / 6, curve = c / 6;
    const Vec2 a = ti.transpose() * uj, b = s.basis.transpose() * ui;
    s.slope_prev = slope * a;
    s.slope = slope * b;
    s.prev_prev = curve * a * a.transpose();
    s.prev_prev.diagonal().array() -= slope * kappa;
    s.own = curve * b * b.transpose();
    s.own.diagonal().array() -= slope * kappa;
    s.cross.noalias() = slope * (ti.transpose() * s.basis);
    s.cross.noalias() += curve * a * b.transpose();
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

void sum_from_tip_to(const Guidewire& wire, int last, NewtonTerms& terms) {
    const bool loaded = !wire.load.isZero(0);
    double carried = 0;  // length of wire whose load is felt
    Vec3 force = Vec3::Zero();
    double torque = 0;
    Vec2 slope_of_next = Vec2::Zero();
    terms.relative_gradient = 0;
    if (last < terms.first || terms.first == 1) terms.proximal_gradient = 0;
    for (int j = wire.segments(); j >= last; --j) {
        RiccatiStage& s = terms.stages[j - 1];
        if (s.touches) force += s.force;
        s.axial = s.length * wire.tangents[j].dot(force);
        if (loaded) {
            carried += wire.length_of(j);
            s.axial -= s.length * carried * wire.tangents[j].dot(wire.load);
        }
        Vec2 g = s.slope + slope_of_next;
        g.noalias() += s.length * (s.basis.transpose() * force);
        slope_of_next = s.slope_prev;
        if (terms.twist) {
            g += torque * s.twist;
            slope_of_next += torque * s.twist_prev;
            torque += s.slope_twist;
        }
        terms.gradient[j - 1] = g;
        double& largest = j >= terms.first ? terms.relative_gradient : terms.proximal_gradient;
        largest = std::max(largest, terms.relative(j - 1));
    }
    // Half of the first segment's load is borne by the introducer itself.
    if (loaded && wire.spec.end_cells == EndCells::Half) carried += wire.length_of(0);
    terms.push = force - carried * wire.load;
    terms.torque = torque;
}

}  // namespace

void assemble(const Guidewire& wire, std::span<const WallContact> contacts,
              const std::vector<Vec3>& directors, int first, NewtonTerms& terms, bool proximal) {
    const int n = wire.segments();
    terms.first = first;
    terms.twist = wire.curved_segments() > 0;
    terms.stages.resize(n);
    terms.gradient.resize(n);
    terms.inverse_spring.resize(n);

    Mat32 prev;
    Vec3 a, b;
    tangent_basis(wire.tangents[first - 1], a, b);
    prev << a, b;
    for (int j = first; j <= n; ++j) {
        RiccatiStage& s = terms.stages[j - 1];
        tangent_basis(wire.tangents[j], a, b);
        s.basis << a, b;
        s.length = wire.lengths[j];
        const double c = wire.spring_constant(j - 1), beta = wire.rest_angle[j - 1];
        terms.inverse_spring[j - 1] = 1 / c;
        const Vec3 &ui = wire.tangents[j - 1], &uj = wire.tangents[j];
        if (beta == 0) {
            straight_joint(c, ui, prev, uj, s);
            s.slope_twist = s.twist_twist = 0;
            s.twist_cross_prev.setZero();
            s.twist_cross.setZero();
        } else {
            curved_joint(c, beta, ui, directors[j - 1], prev, uj, s);
        }
        if (terms.twist) {
            const Vec3 turn = ui.cross(uj) / std::max(1e-9, 1 + ui.dot(uj));
            s.twist_prev = -(prev.transpose() * turn);
            s.twist = -(s.basis.transpose() * turn);
        }
        prev = s.basis;
        const WallContact& contact = contacts[j];
        s.touches = contact.touches();
        if (s.touches) {
            s.force = contact.push();
            s.stiffness = contact.stiffness * contact.normal * contact.normal.transpose() +
                          contact.force() * contact.curvature;
        }
    }
    // From the tip: loads, and the twist that the torque distal of a joint gives its two segments.
    if (!wire.load.isZero(0)) {
        double carried = 0;
        for (int j = n; j >= first; --j) {
            RiccatiStage& s = terms.stages[j - 1];
            carried += wire.length_of(j);
            s.slope.noalias() -= s.length * carried * (s.basis.transpose() * wire.load);
        }
    }
    if (terms.twist) {
        // The second-order twist of a joint is half the area that its two tangents sweep against each other.
        double torque = 0;
        for (int j = n; j >= first; --j) {
            RiccatiStage& s = terms.stages[j - 1];
            if (j > first && torque != 0) {
                const Vec3 axis = 0.5 * torque * (wire.tangents[j - 1] + wire.tangents[j]).normalized();
                const Mat32& ti = terms.stages[j - 2].basis;
                s.cross.col(0) += ti.transpose() * Vec3(s.basis.col(0)).cross(axis);
                s.cross.col(1) += ti.transpose() * Vec3(s.basis.col(1)).cross(axis);
            }
            torque += s.slope_twist;
        }
    }
    sum_from_tip_to(wire, proximal ? 1 : first, terms);
}

void sum_from_tip(const Guidewire& wire, NewtonTerms& terms) {
    sum_from_tip_to(wire, 1, terms);
}

}  // namespace physics
