#pragma once
/// Bending energy of a chain, Eqs. 1–4, as a sum over its devices: each bends from its own rest direction.
///
/// Of device k alone joint i bends by the angle between u_{i+1} and the rest direction m_i = cos β u_i +
/// sin β d, so that κ_i = m_i·u_{i+1}; where it is straight this is the paper's κ_i = u_i·u_{i+1}.
/// `directors` are as from physics::directors(); they are not used, and may be empty, where bent_segments()
/// is 0.

#include <cassert>

#include "physics/wire/chain.h"

namespace physics {

/// U = C/12 (13 − 14 κ + κ²), Eq. 1, of a joint between unit vectors rest and next [N·mm]. Computed from
/// |rest − next|², because the printed form loses all digits where the wire is nearly straight.
inline double joint_energy(double spring_constant, const Vec3& rest, const Vec3& next) {
    assert(spring_constant >= 0);
    const double d = 0.5 * (rest - next).squaredNorm();  // 1 − κ
    assert(d < 2 + 1e-9);
    return spring_constant / 12 * d * (12 + d);
}

/// Energy of joint i, without couplings [N·mm].
double bent_joint_energy(const Chain&, const std::vector<Vec3>& directors, int joint);
inline double joint_energy(const Chain& chain, const std::vector<Vec3>& directors, int joint) {
    if (!chain.straight(joint)) return bent_joint_energy(chain, directors, joint);
    return chain.stored[joint] +
           joint_energy(chain.spring_constant(joint), chain.tangents[joint], chain.tangents[joint + 1]);
}

/// Energy, torque on the outer device and curvature of a coupling [N·mm].
struct CouplingTerms {
    double energy = 0, slope = 0, curve = 0;
};
CouplingTerms coupling_terms(const Chain&, const Coupling&);
/// Σ of the couplings of joints from `first` on [N·mm].
double coupling_energy(const Chain&, int first = 0);

/// [i] = Σ over joints j ≥ i of dU_j/dφ_j: torque on a device's material frame at segment i, of its bends and
/// of the wall's grips on it [N·mm]; size N+2, the last entries zero.
void frame_torque(const Chain&, const std::vector<Vec3>& directors, int device, std::vector<double>& torque);
/// The same summed over the devices: what a turn of the chain's own frame meets.
void frame_torque(const Chain&, const std::vector<Vec3>& directors, std::vector<double>& torque);

/// Pull b and curvature A of the bending energy felt by one segment (Eq. 4):
///   U(ε) = U(0) − b·ε + ½ ε·A·ε,   ε = change of the unit tangent u_i.
/// Where something is bent at rest b also includes the turn of its rest direction by parallel transport; A is
/// that of κ linear in ε. `torque` is the frame_torque() of all devices.
struct BendingTerms {
    Vec3 pull = Vec3::Zero();       // b [N·mm]
    Mat3 curvature = Mat3::Zero();  // A [N·mm]
};
BendingTerms bending_terms(const Chain&, const std::vector<Vec3>& directors,
                           const std::vector<double>& torque, int segment);

/// Contribution of a joint that is straight at rest to P of its two segments, both varied: ε_i·this·ε_{i+1}
/// of Eq. 1.
Mat3 neighbour_curvature(const Chain&, int joint);

double bending_energy(const Chain&);  // [N·mm]

}  // namespace physics
