#pragma once
/// One step of Newton's method: trials until one lowers the energy enough.

#include "physics/relax/global_options.h"
#include "physics/relax/iterate.h"
#include "physics/relax/relaxer.h"

namespace physics {

/// A trial is the minimum of the quadratic model with the trust region μ, rolled out along the wire. It is
/// accepted only where the true energy falls enough (Armijo). Where it does not, the wall's part of the model
/// is made again with the wall as it is at the trial state: a stiff, curved wall needs that, for a wire that
/// moves along the tangent plane of a contact departs from the wall, or enters it, by a second-order
/// distance.
class NewtonStep {
public:
    enum class Result {
        Accepted,
        OutOfBudget,  // of updates; the wire is as it was, the model is not
        NothingLower  // no trial lowers the energy; as above
    };

    /// A step whose trials take no more than `most_updates` of the report's updates, but for the first.
    NewtonStep(Iterate&, Chain&, ContactSet&, const GlobalOptions&, bool smooth_wall, int most_updates,
               RelaxReport&);

    Result take();

private:
    /// What a trial leads to.
    enum class Next { Accepted, OutOfBudget, NothingLower, OtherRegion, CorrectedWall };
    struct Trial {
        int region = 0, correction = 0;  // how many μ, and walls for this μ, have been tried before
        bool is_first() const { return region == 0 && correction == 0; }
    };

    double largest_move() const;
    double energy_rounding() const;
    Next attempt(const Trial&);
    bool fits(const Trial&, double reach);
    bool lowers_energy(const Trial&);
    void accept(double reach);
    Next reject(const Trial&);

    Iterate& at_;
    Chain& wire_;
    ContactSet& contacts_;
    const GlobalOptions& options_;
    const bool smooth_;
    const int most_updates_;
    RelaxReport& report_;
    const int first_, window_;
    const double cap_;         // Δ [mm]
    const double rounding_;    // of the energy [N·mm]
    const double rounded_;     // what a joint's place is rounded by [mm]
    int rejected_ = 0;         // values of μ whose every correction raised the energy
    double uncorrected_ = 0;   // slope of this μ's first trial [N·mm]
    double trial_energy_ = 0;  // [N·mm]
};

}  // namespace physics
