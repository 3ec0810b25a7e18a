#pragma once
/// A mass–spring chain brought to rest by dynamic relaxation (A. S. Day 1965; P. Underwood 1983; M. R. Barnes
/// 1999): point masses, axial springs EA/λ, bending springs ½Cθ² at the joints, springs k against the wall,
/// and fictitious masses just large enough for a time step of 1 to be stable.

#include "engine/studies/baselines/baseline.h"

namespace baselines {

enum class Damping {
    Kinetic,  // all velocities are dropped at each peak of the kinetic energy
    Critical  // viscous, 2ω of the slowest motion under way, which Rayleigh's quotient estimates
};

class SpringChain final : public Baseline {
public:
    /// `safety`: of the masses over the least that Gershgorin's bound asks for.
    SpringChain(const RodSpec& spec, const Tube* tube, Damping damping, double safety = 2)
        : Baseline(spec, tube), damping_(damping), safety_(safety) {}
    void start(const std::vector<Vec3>& nodes) override;
    Progress advance(int rounds) override;
    double energy() const override;

private:
    void find_forces();

    Damping damping_;
    double safety_;
    std::vector<Vec3> forces_, old_forces_, velocities_, axes_;
    std::vector<char> pressed_;
    double kinetic_ = 0;
};

}  // namespace baselines
