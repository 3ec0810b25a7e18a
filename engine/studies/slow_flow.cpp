#include "engine/studies/slow_flow.h"

#include <algorithm>
#include <cmath>

#include "physics/wire/bending.h"
#include "physics/wire/energy.h"

namespace studies {
namespace {

using geometry::Mat3;
using geometry::Vec2;
using geometry::Vec3;
using physics::Chain;
using Mat2 = Eigen::Matrix2d;
using Mat32 = Eigen::Matrix<double, 3, 2>;
using Mat23 = Eigen::Matrix<double, 2, 3>;

/// Second-order model of segment j: its turn α_j in the plane ⟂ u_j, its distal joint x_j.
struct Stage {
    Mat32 basis;            // T_j
    double length = 0;      // λ_j [mm]
    double axial = 0;       // λ u_j·s_j, with s_j the wall's force on everything distal [N·mm]
    Vec3 force;             // of the wall at joint j [N]
    Mat3 stiffness;         // [N/mm]
    Vec2 slope;             // of the energy without the wall, over α_j [N·mm]
    Mat2 prev, own, cross;  // of the bending at joint j−1, over α_{j−1} and α_j [N·mm]
};
struct Gain {
    Vec2 step;
    Mat23 from_x;
    Mat2 from_prev;
};

std::vector<Stage> model(const Chain& wire, const std::vector<physics::WallContact>& contacts) {
    const int n = wire.segments();
    const std::vector<Vec3> d = physics::directors(wire);
    std::vector<double> torque;
    physics::frame_torque(wire, d, torque);
    std::vector<Stage> stages(static_cast<std::size_t>(n) + 1);
    Vec3 a, b, sum = Vec3::Zero();
    geometry::tangent_basis(wire.tangents[0], a, b);
    stages[0].basis << a, b;
    for (int j = 1; j <= n; ++j) {
        Stage& s = stages[j];
        const Vec3 &u = wire.tangents[j], &before = wire.tangents[j - 1];
        geometry::tangent_basis(u, a, b);
        s.basis << a, b;
        s.length = wire.lengths[j];
        s.force = contacts[j].push();
        s.stiffness.setZero();
        if (contacts[j].touches())
            s.stiffness = contacts[j].stiffness * (contacts[j].normal * contacts[j].normal.transpose() +
                                                   contacts[j].penetration * contacts[j].curvature);
        s.slope = -s.basis.transpose() * physics::bending_terms(wire, d, torque, j).pull;
        s.prev = s.own = s.cross = Mat2::Zero();
        for (const physics::Device& device : wire.devices) {
            // U = C/12 (13 − 14 κ + κ²), κ = m·u; the rest direction m turns rigidly with u_{j−1}.
            const double c = device.rigidity[j - 1] / wire.length_of(j - 1);
            const physics::RestBend bend = physics::rest_bend(device, j - 1, before, d[j - 1]);
            const Vec3 m = physics::rest_direction(before, bend);
            const Mat3 turn =
                bend.cosine * Mat3::Identity() - bend.sine * before * bend.direction.transpose();
            const double kappa = m.dot(u), first = -c * (7 - kappa) / 6, second = c / 6;
            const Vec2 prev = stages[j - 1].basis.transpose() * turn.transpose() * u,
                       own = s.basis.transpose() * m;
            s.prev += second * prev * prev.transpose() - first * kappa * Mat2::Identity();
            s.own += second * own * own.transpose() - first * kappa * Mat2::Identity();
            s.cross += second * prev * own.transpose() +
                       first * stages[j - 1].basis.transpose() * turn.transpose() * s.basis;
        }
    }
    for (int j = n; j >= 1; --j) {
        sum += stages[j].force;
        stages[j].axial = stages[j].length * wire.tangents[j].dot(sum);
    }
    return stages;
}

/// Backward pass from the tip; returns false where the model with this drag is not convex.
bool solve(const std::vector<Stage>& stages, double drag, std::vector<Gain>& gains) {
    Mat3 P = Mat3::Zero();
    Mat32 Px = Mat32::Zero();
    Mat2 Pa = Mat2::Zero();
    Vec3 p = Vec3::Zero();
    Vec2 pa = Vec2::Zero();
    for (std::size_t j = stages.size() - 1; j >= 1; --j) {
        const Stage& s = stages[j];
        P += s.stiffness + drag * s.length * Mat3::Identity();
        p += s.force;
        const Mat32 Y = s.length * P * s.basis + Px;
        const Mat2 Q = s.length * s.basis.transpose() * Y + s.length * Px.transpose() * s.basis + Pa + s.own -
                       s.axial * Mat2::Identity();
        if (!(Q.trace() > 0 && Q.determinant() > 1e-14 * Q.trace() * Q.trace())) return false;
        const Mat2 inverse = Q.inverse();
        Gain& gain = gains[j];
        gain.step = -inverse * (s.length * s.basis.transpose() * p + pa + s.slope);
        gain.from_x = -inverse * Y.transpose();
        gain.from_prev = -inverse * s.cross.transpose();
        P += Y * gain.from_x;
        P = (0.5 * (P + P.transpose())).eval();
        p += Y * gain.step;
        Px = Y * gain.from_prev;
        Pa = s.prev + s.cross * gain.from_prev;
        pa = s.cross * gain.step;
    }
    return true;
}

/// Returns the wire after the step, and how far its farthest joint moved.
double advance(const Chain& from, const std::vector<Stage>& stages, const std::vector<Gain>& gains,
               Chain& to) {
    Vec2 alpha = Vec2::Zero();
    double farthest = 0;
    for (int j = 1; j <= from.segments(); ++j) {
        alpha = gains[j].step + gains[j].from_x * (to.joints[j - 1] - from.joints[j - 1]) +
                gains[j].from_prev * alpha;
        to.tangents[j] = (from.tangents[j] + stages[j].basis * alpha).normalized();
        to.joints[j] = to.joints[j - 1] + to.lengths[j] * to.tangents[j];
        farthest = std::max(farthest, (to.joints[j] - from.joints[j]).norm());
    }
    return farthest;
}

}  // namespace

SlowFlowReport flow_to_rest(Chain& wire, const physics::LumenWall& wall, const SlowFlow& flow) {
    SlowFlowReport report;
    physics::rebuild_joints(wire);
    auto contacts = physics::all_contacts(wire, wall);
    report.energy = physics::total_energy(wire, contacts).total();
    std::vector<Gain> gains(wire.joints.size());
    const double stiff = wire.rigidity[0] / std::pow(wire.grid.segment_length, 4);
    const double least = 1e-12 * stiff, most = 1e12 * stiff;
    double drag = stiff;
    while (true) {
        report.gradient = physics::relative_gradient(wire, contacts);
        report.at_rest = report.gradient <= flow.tolerance;
        if (report.at_rest || report.steps >= flow.most_steps || !std::isfinite(report.energy)) return report;
        const std::vector<Stage> stages = model(wire, contacts);
        bool moved = false;
        while (!moved && drag < most) {
            if (!solve(stages, drag, gains)) {
                drag = std::max(4 * drag, least);
                continue;
            }
            Chain next = wire;
            const double farthest = advance(wire, stages, gains, next);
            if (!(farthest <= flow.stride)) {
                const double over = std::isfinite(farthest) ? farthest / flow.stride : 30;
                drag = std::max(drag * std::clamp(over * over, 2.0, 30.0), least);
                continue;
            }
            auto after = physics::all_contacts(next, wall);
            const double energy = physics::total_energy(next, after).total();
            if (!(energy <= report.energy + 1e-15 * std::abs(report.energy))) {
                drag = std::max(4 * drag, least);
                continue;
            }
            for (std::size_t i = 1; i < after.size(); ++i) next.stations[i] = after[i].station;
            wire = std::move(next);
            contacts = std::move(after);
            moved = true;
            ++report.steps;
            if (energy == report.energy && farthest < 1e-12) report.at_rest = true;
            report.energy = energy;
            drag = drag < least ? 0 : 0.25 * drag;
        }
        if (!moved || report.at_rest) {  // no step lowers the energy any more
            report.gradient = physics::relative_gradient(wire, contacts);
            report.at_rest = true;
            return report;
        }
    }
}

}  // namespace studies
