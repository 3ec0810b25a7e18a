#pragma once
/// A position-based rod: XPBD (M. Macklin, M. Müller, N. Chentanez, XPBD: position-based simulation of
/// compliant constrained dynamics, 2016) in small substeps (M. Macklin et al., Small steps in physics
/// simulation, 2019).
///
/// Constraints, projected one after the other (Gauss–Seidel), forwards and backwards by turns: segments keep
/// their length exactly; a joint bends with the compliance 1/C on u_{i+1} − u_i, whose energy is
/// 2C sin²(θ/2); a node outside the lumen is pushed back with the compliance 1/k.

#include "engine/studies/baselines/baseline.h"

namespace baselines {

struct PositionSettings {
    double step = 0.01;    // Δt² over a node's mass [mm/N]
    int iterations = 1;    // of Gauss–Seidel in a substep
    bool momentum = true;  // velocities are carried until the rod turns back, else each substep starts still
    bool warm_start = true;  // multipliers are carried from substep to substep, else start at zero
};

class PositionRod final : public Baseline {
public:
    PositionRod(const RodSpec& spec, const Tube* tube, const PositionSettings& settings)
        : Baseline(spec, tube), settings_(settings) {}
    void start(const std::vector<Vec3>& nodes) override;
    Progress advance(int rounds) override;
    double energy() const override;

private:
    void keep_length(int segment);
    void bend(int joint);
    void press(int node);
    void apply_multipliers();

    PositionSettings settings_;
    std::vector<Vec3> step_, moves_;           // of the last substep; of the multipliers carried over
    std::vector<Vec3> bends_;                  // multipliers
    std::vector<double> stretches_, presses_;  // multipliers
    std::vector<Touch> touches_;               // as last asked
};

}  // namespace baselines
