#pragma once
/// The arteries beyond the ends of the lumen, as the contrast that is on its way through them.

#include <span>
#include <vector>

#include "engine/blood/blood_flow.h"
#include "physics/geometry/state.h"

namespace blood {

/// Time that blood at rest takes from an end with this radius [mm] and flow [ml/s] to arteries of 0.15 mm
/// radius. In a tree by Murray's law (1926) velocity is proportional to radius, so that every generation, ten
/// radii long (Zamir 1999, coronary arteries: 7 to 12), takes equally long [s].
double arterial_time(double radius, double flow);

/// Contrast passes the arteries behind every end in bins of equal time at rest, and is carried on as fast as
/// the blood leaves the end. What enters is conserved to rounding.
class DistalArteries {
public:
    static constexpr int bins = 24;  // of every end

    explicit DistalArteries(std::span<const Outlet> = {});

    /// Takes `entering` [mg] at an outlet while blood leaves it at `flow` [ml/s] for `dt` [s]; returns what
    /// leaves the arteries for the organ's small vessels [mg].
    double pass(int outlet, double entering, double flow, double dt);
    void reset();

    /// In each bin of each outlet in order [mg/ml].
    std::span<const float> iodine() const { return shown_; }
    void show();
    double held(int outlet) const;  // [mg]
    void state(geometry::StateStream& s) { s(mass_, shown_); }

private:
    std::vector<double> volume_;  // of a bin of each outlet [ml]; 0 where no blood leaves
    std::vector<double> mass_;    // of each bin [mg]
    std::vector<float> shown_;
};

}  // namespace blood
