#pragma once
/// The fluid in the bore of a catheter or sheath: contrast goes in at the hub and comes out at the end.

#include <vector>

#include "physics/geometry/state.h"

namespace blood {

/// Flows as a laminar tube does: parabolic, u(r) = 2 ū (1 − r²/R²), in rings of equal area that do not mix.
/// Fluid in the middle comes out after half the time that a plug would take, and a film at the wall stays
/// long after the rest has been flushed out. At the rates of a hand the Reynolds number is about 500; a
/// pump's turbulent front would be blunter. Full of saline at first.
class Bore {
public:
    static constexpr int rings = 8;

    Bore();
    /// What the bore holds, its devices aside [ml]. A smaller one gives up the excess at the hub, in
    /// proportion; a larger one draws in saline. Returns the iodine given up [mg].
    double resize(double volume);
    /// Pushes so much [ml] of that concentration [mg/ml] in at the hub; returns the iodine that comes out at
    /// the end [mg].
    double push(double volume, double iodine);
    double volume() const { return volume_; }  // [ml]
    double iodine() const;                     // [mg]
    /// Mean concentration over the cross-section at equal parts of the length, from the hub to the end
    /// [mg/ml]; empty for a bore without iodine.
    std::vector<float> profile(int parts) const;

    void state(geometry::StateStream& s) { s(volume_, columns_); }

private:
    struct Plug {
        double length = 1;  // of the bore's [-]
        double iodine = 0;  // [mg/ml]
        void state(geometry::StateStream& s) { s(length, iodine); }
    };
    struct Column {
        std::vector<Plug> plugs;  // from the hub to the end; their lengths add up to 1
        void state(geometry::StateStream& s) { s(plugs); }
    };
    double volume_ = 0;
    std::vector<Column> columns_;  // from the middle to the wall
};

}  // namespace blood
