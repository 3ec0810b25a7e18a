#pragma once
/// Bending energy of the wire, Eqs. 1–4, with a rest direction at every joint of the curved tip.
///
/// Joint i bends by the angle between u_{i+1} and the rest direction m_i = cos β u_i + sin β d_i, so that
/// κ_i = m_i·u_{i+1}; for a straight rest shape this is the paper's κ_i = u_i·u_{i+1}.

#include "physics/wire/guidewire.h"

namespace physics {

/// U = C/12 (13 − 14 κ + κ²), Eq. 1, of a joint between unit vectors rest and next [N·mm]. Computed from
/// |rest − next|², because the printed form loses all digits where the wire is nearly straight.
double joint_energy(double spring_constant, const Vec3& rest, const Vec3& next);

/// Rest direction m_i of joint i of a wire alone; d is the director of segment i.
Vec3 rest_direction(const Guidewire&, int joint, const Vec3& d);
/// Rest direction of a device behind a segment with tangent u.
Vec3 rest_direction(const Vec3& u, const RestBend&);

/// Energy of joint i [N·mm]; `directors` as from physics::directors, unused where the rest shape is straight.
double joint_energy(const Guidewire&, const std::vector<Vec3>& directors, int joint);

/// [i] = Σ over joints j ≥ i of dU_j/dψ_j: the bent tip's torque on the material frame at i [N·mm]. Only the
/// curved tip contributes; size N+2, the last two entries zero.
void tip_torque(const Guidewire&, const std::vector<Vec3>& directors, std::vector<double>& torque);
/// The same of one of a chain's devices alone.
void device_torque(const Guidewire&, int device, const std::vector<Vec3>& directors,
                   std::vector<double>& torque);

/// Pull b and curvature A of the bending energy felt by one segment (Eq. 4):
///   U(ε) = U(0) − b·ε + ½ ε·A·ε,   ε = change of the unit tangent u_i.
/// With a curved tip b also includes the turn of its rest direction by parallel transport; A is that of κ
/// linear in ε.
struct BendingTerms {
    Vec3 pull = Vec3::Zero();       // b [N·mm]
    Mat3 curvature = Mat3::Zero();  // A [N·mm]
};
BendingTerms bending_terms(const Guidewire&, const std::vector<Vec3>& directors,
                           const std::vector<double>& torque, int segment);

/// Contribution of a joint that is straight at rest to P of its two segments, both varied: ε_i·this·ε_{i+1}
/// of Eq. 1.
Mat3 neighbour_curvature(const Guidewire&, int joint);

double bending_energy(const Guidewire&);  // [N·mm]

}  // namespace physics
