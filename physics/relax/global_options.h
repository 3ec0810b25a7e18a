#pragma once
/// What the global relaxer goes by. Each field states the inequality that it enters; docs/solver.md derives
/// them. Lower case letters of the formulas:
///
///   C       spring constant EI/λ of a joint [N·mm]; |g|/C the relative gradient, |dU/dα| over it
///   U       energy of the window [N·mm]; ‖U‖ = |U| + the load's part of it, what its differences round by
///   μ, μ₀   the trust region and its unit [N/mm²]
///   Δ       the largest move of a joint that a step may make [mm]; reach = (largest move of the step)/Δ
///   R       radius that a joint's place in the lumen leaves it, WallContact::room [mm]
///   n, w    segments of the wire and of the window

namespace physics {

/// How long a step may be, and how its trust region μ is found: TrustRegion.
struct TrustOptions {
    /// Δ = step_share · min R. A longer step is never shortened, which would fold the wire: it is computed
    /// again with a larger μ.
    double step_fraction = 0.3;
    /// Δ = kinked_share · min R for a window with a joint beyond 60°, where u_i·u_{i+1} < kinked_cosine: from
    /// a kink lead ways to many rests.
    double kinked_fraction = 0.03, kinked_cosine = 0.5;
    /// Δ where no joint knows a lumen [mm]: any step fits.
    double unbounded = 1e9;

    /// A μ that must be positive is at least least_share · μ₀.
    double least_fraction = 1e-5;
    /// A step is given up where μ > most_share · μ₀: no joint then moves by what its place is rounded by.
    double most_fraction = 1e30;
    /// μ < forgotten_share · μ₀ becomes 0 after a step that was taken.
    double forgotten_fraction = 1e-8;
    /// Most values of μ that one step tries.
    int most_trials = 40;

    /// After a step that went too far, reach > 1:  μ ← μ · clamp(reach², least_growth, most_growth).
    double least_growth = 2, most_growth = 30;
    /// The factor is at most first_growth on the first trial of a step, whose μ fitted the step before. It is
    /// also that of μ ← first_growth · μ after an idle step that was too short (short_step).
    double first_growth = 10;
    /// The factor where the wall of the model was corrected, whose reach says little of other μ; and after a
    /// μ with which every corrected trial raised the energy, then with μ ≥ rejected_share · μ₀.
    double corrected_growth = 4, rejected_fraction = 1e-4;
    /// Two trials with reach < secant_reach give the secant of 1/reach, nearly a straight line in μ; the next
    /// μ is where it meets 1/secant_aim, within [secant_least, secant_most] · μ.
    double secant_reach = 20, secant_aim = 0.8, secant_least = 1.5, secant_most = 1000;

    /// reach < short_step is too short for a step that leads nowhere.
    double short_step = 0.03;
    /// Once a step was too short, μ is bisected, √(μ_far μ_short), between the largest μ_far that went too
    /// far, at least lowest_share · μ_short, and itself, while μ_short > bracket · μ_far and for at most
    /// most_bisections trials.
    double lowest_fraction = 1e-4, bracket = 2;
    int most_bisections = 5;

    /// After an accepted step  μ ← μ · clamp(reach², least_shrink, 1), so that the next one just fits; with
    /// cautious_shrink in place of least_shrink where a μ of this step was rejected.
    double least_shrink = 0.01, cautious_shrink = 0.25;
};

/// What makes a step acceptable, and when steps lead nowhere: NewtonStep, Descent.
struct StepOptions {
    /// Backward passes for one μ, the model's wall made again at the trial state between them.
    int corrections = 4;
    /// The first so many values of μ begin with the wall's forces as the last step foresaw them, later ones
    /// with those of the accepted state.
    int trials_predicted = 2;
    /// A slipping grip's own model serves a trial in which it keeps more than this fraction of its stretch
    /// along it, e₀·e₁ > slips_on · |e₀|². Along itself the potential has no curvature, so that any fraction
    /// serves that tells slipping on from turning back.
    double slips_on = 0.5;
    /// Armijo: U(trial) ≤ U + armijo · slope, slope = Σ g·α ≤ 0, on the last correction; with good_armijo on
    /// those before, for a better wall can still be had.
    double armijo = 1e-4, good_armijo = 0.2;
    /// A corrected trial must also fall by corrected_share of the slope of the uncorrected one: a corrected
    /// wall whose rest is where the wire is would otherwise leave it there for ever.
    double corrected_fraction = 0.02;
    /// Rounding of the energy: rounding_share · ‖U‖ + rounded_places · ε · |x| Σ|f|. A fall below it can't be
    /// seen; it is believed of the uncorrected model if U(trial) < U + rounding.
    double rounding_fraction = 1e-13, rounded_places = 4;
    /// On a wall whose normals jump a step is given up after so many rejected μ.
    int most_rejections_on_planes = 3;

    /// A step is progress where |g|/C < progress_gradient · (the least of the window so far), or where
    /// U falls by more than progress_energy · ‖U‖. Any other is idle and counts 1 if reach > sliding, for
    /// then the wire moves, else hardly_moved.
    double progress_gradient = 0.5, progress_energy = 1e-4, sliding = 0.05;
    int hardly_moved = 10;
    /// Idle count from which μ is bisected (TrustOptions::short_step), and beyond which the descent is stuck.
    int idle_before_bisection = 30, most_idle = 400;
};

/// The distal segments that move: Descent.
struct WindowOptions {
    /// The first window has max(least, per_changed · (changed segments), those not at rest) segments.
    int least = 32, per_changed = 2;
    /// The window is widened where |g|/C within ≤ settled_share · |g|/C proximal of it; that proximal of it
    /// is summed again once the one within has fallen below settled_share of what it was then.
    double settled_fraction = 0.1;
    /// A window of w segments becomes one of widening · w.
    int widening = 8;
    /// Segments of a window proximal of the first joint that has changed to another vessel.
    int margin = 8;
};

/// What is done at |g| = 0 where the Hessian is not positive: Descent::leave_saddle.
struct SaddleOptions {
    /// The worst segment is turned by ±kick · 4⁻ᵏ > least_kick along its negative curvature [rad], until the
    /// energy is lower.
    double kick = 1e-3, kick_factor = 0.25, least_kick = 1e-7;
    /// A pivot that is not positive is mirrored and is at least pivot_share · max C.
    double pivot_fraction = 1e-6;
};

/// The way out of a dead end through softer walls: SofterWalls.
struct SofteningOptions {
    /// The first wall has k = min C/λ², with which the descent always converges; each next one is
    /// hardening · k, up to the wall's own.
    double hardening = 10;
    /// Work in each wall is at most most_passes · n updates.
    int most_passes = 400;
};

/// Where a wire starts from after a motion: predict().
struct PredictionOptions {
    /// An answer counts if it moves no joint by more than min R, and raises the energy by at most
    /// |U| + most_work · |push · feed|: beyond that the model is good for nothing.
    double most_work = 4;
    /// It is made once more with the wall at the place that it leads to, where it raises the energy by more
    /// than good_share · (|U| + most_work · |push · feed|).
    double good_fraction = 0.01;
    /// |U| is at least that of a chain that is turned by this at each joint, ½ Σ C turn² [rad]: the energy of
    /// a chain that lies free is rounding.
    double least_turned = 1e-8;
    /// Where the whole motion does not count, halves of it are tried, down to a feed of least_feed · λ and a
    /// turn of least_turn [rad] ...
    double least_feed = 0.1, least_turn = 0.1;
    /// ... and then stiffer answers, μ ← max(TrustOptions::least_share μ₀, stiffening μ), while
    /// μ < sliding · μ₀, at which the wire just slides on.
    double stiffening = 10, sliding = 1e3;
    /// Segments whose answer is evaluated; the wire answers on all of them where a turn comes from the base.
    int window = 64;
    /// Another answer is tried while updates + most_passes · n ≤ budget; the first one is always tried.
    int most_passes = 5;
};

/// Normal forces F of friction, and the ways D by which vessels have moved, lag behind the wall's:
/// LaggedForces.
struct LagOptions {
    /// Rests that are sought with F held fixed, for one motion.
    int most_rounds = 15;
    /// F agrees with the wall's forces where max |ΔF| ≤ tolerance · max F.
    double tolerance = 1e-3;
    /// D agrees with what the wall's forces make of the vessels where
    /// max |ΔD| ≤ yield_tolerance · max |D| + least_way [mm].
    double yield_tolerance = 2e-2, least_yield = 1e-3;
    /// With both changes as multiples of what is tolerated, forces and ways go half of their way where the
    /// largest > halved_share · that of the round before ...
    double halved_fraction = 0.8;
    /// ... and are left as they are, after least_rounds, where it is > stalled_share · that of two rounds
    /// before.
    int least_rounds = 5;
    double stalled_fraction = 0.7;
    /// The first loose_rounds rests need only |g|/C ≤ loose_gradient, and no certificate.
    int loose_rounds = 5;
    double loose_gradient = 1e-5;
};

struct GlobalOptions {
    TrustOptions trust;
    StepOptions step;
    WindowOptions window;
    SaddleOptions saddle;
    SofteningOptions softening;
    PredictionOptions prediction;
    LagOptions lag;
    /// A call makes its first step with at least first_trials · step.corrections passes over its window,
    /// whatever its budget.
    int first_trials = 2;
};

}  // namespace physics
