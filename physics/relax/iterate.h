#pragma once
/// The accepted state that Newton's method has come to: its energy, its quadratic model, its trust region.

#include "physics/relax/contact_set.h"
#include "physics/relax/newton_model.h"
#include "physics/relax/trust_region.h"

namespace physics {

/// Belongs to one wire and outlives a descent: the next one goes on from it, and a prediction answers by its
/// model.
struct Iterate {
    explicit Iterate(const TrustOptions& options) : trust(options) {}

    TrustRegion trust;
    double energy = 0;      // of the window; a load makes it negative [N·mm]
    double load_scale = 0;  // of the load's part of it [N·mm]
    int idle = 0;           // count of consecutive steps that led nowhere
    NewtonModel model;
    RiccatiReport pivots;      // of the model
    int foreseen = 0;          // joints whose forces the model has foreseen, for the next descent
    double best_gradient = 0;  // least |g|/C of the window so far [-]
    bool goes_on = false;      // the next descent continues one that its budget has cut

    int window(const Chain& wire) const { return wire.segments() - model.first() + 1; }
    /// ‖U‖, what differences of the energy round by [N·mm].
    double energy_scale() const;
    /// The trust region's unit and the least pivot, from the wire and its lumen:
    /// μ₀ = C λ / R⁴, whatever the segments' length.
    void set_units(const Chain&, const ContactSet&, const GlobalOptions&);
    /// Model of the state, with the window from segment `first` on, and its minimum at the trust region as
    /// it is. Where the shaft winds up, the window holds all of the curved tip: this is what turns the shaft.
    void linearise(const Chain&, const ContactSet&, int first);
    /// Energy of the model's window.
    void measure_window(const Chain&, const ContactSet&);
    /// Model and energy of a window of so many distal segments, and the gradient proximal of it.
    void open_window(const Chain&, const ContactSet&, int segments);
    /// The model's trial state becomes the wire's.
    void accept(Chain&, ContactSet&, double trial_energy);
    /// The material frames become those of this wire.
    void look_at(const Chain&);
    /// The material frames become the accepted ones again, from this segment on, after trials.
    void restore_frames(const Chain&, int first);

    void state(StateStream& s) { s(trust, energy, load_scale, idle, model, pivots, foreseen, best_gradient); }
};

}  // namespace physics
