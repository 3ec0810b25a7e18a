#pragma once
/// How blood runs through a vessel tree: cells along its centrelines, the path from the source to the ends,
/// and the flow through each end.
///
/// The vessels themselves resist no flow and all ends drain against the same venous pressure, so each end
/// takes a fixed fraction of whatever enters the tree. The source delivers its inflow at any pressure. What a
/// complication leaves in the way of blood resists it: BloodFlow::obstructed. Beyond the ends, contrast is on
/// its way through the arteries of the organ: DistalArteries.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/anatomy/anatomy.h"
#include "physics/geometry/state.h"
#include "physics/geometry/vec.h"

namespace blood {

/// What is in the way of blood in a branch.
struct Obstruction {
    int branch = 0;                                                                 // of the anatomy
    geometry::Vec3 from = geometry::Vec3::Zero(), middle = geometry::Vec3::Zero();  // on its centreline [mm]
    /// Pressure that it takes of a flow Q [ml/s]: laminar · Q + turbulent · Q² [Pa s/ml], [Pa s²/ml²].
    double laminar = 0, turbulent = 0;
    double passes = 1;  // fraction of the flow that a plug lets by; 0 = none, and nothing gets beyond it [-]
};

struct FlowSpec {
    std::string source;            // the end where blood enters; empty = the widest
    std::optional<double> inflow;  // mean, at the source [ml/s]; empty = usual_flow of its radius
    double exponent = 3.0;         // an end's flow follows its radius to this power (Murray 1926) [-]
    double heart_rate = 70.0;      // [1/min]
    // Fraction of the flow that comes in systole, 0 = steady. (Highest − lowest flow) / mean is 3.2 times
    // this: here 1.6, between arteries of organs, whose flow never stops, and the aorta (estimate) [-].
    double pulsatility = 0.5;
    // Dispersion of a bolus in units of radius times mean velocity. 0.7 is that of turbulent pipe flow at the
    // Reynolds numbers of arteries (Taylor 1954: 10.1 r u*, with a friction velocity u* of 0.07 of the mean);
    // a jet from a catheter mixes at least as well (estimate).
    double dispersion = 0.7;
    double limit = 300.0;                       // of contrast in one procedure [ml]; see contrast_limit
    double systolic = 120.0, diastolic = 80.0;  // pressure in the aorta: a healthy adult's (texts) [mmHg]
};

/// Mean of the aorta's pressure over a beat: 0.325 of the way from diastole to systole, near the third that
/// texts state: 93 mmHg of 120/80 [mmHg].
double mean_pressure(const FlowSpec&);

/// A stenosis of the vessels as they are: its cells along the flow, what each resists beyond the vessel as it
/// would be without it, and the jet behind the throat; see Obstruction.
struct Lesion {
    std::vector<int> cells;
    std::vector<double> laminar;  // of each [Pa s/ml]
    double turbulent = 0;         // [Pa s²/ml²]
    std::size_t throat = 0;       // of `cells`
};

/// Everything wrong with a spec taken by itself; empty when it is usable.
std::vector<std::string> problems(const FlowSpec&);

/// Mean flow at rest through an artery of that radius [mm]: 84 ml/s through an ascending aorta of 16 mm (5
/// l/min), 4.1 ml/s through an internal carotid of 2.35 mm (250 ml/min), and the power law through both. In
/// between it gives 43 ml/s for an aorta of 10.5 mm below the coeliac trunk; MR measured 51 above the trunk
/// and 17.5 below the renal arteries of patients with aneurysms (Les 2010) [ml/s].
double usual_flow(double radius);

/// A piece of vessel.
struct FlowCell {
    geometry::Vec3 centre;  // on the centreline [mm]
    double radius;          // [mm]
    double length;          // [mm]
    double volume;          // [ml]
    int branch;             // of the anatomy
    int upstream = -1;      // the cell its blood comes from at rest, listed before it; -1 at a source
    double distance = 0;    // to the upstream cell [mm]
};

/// What follows the small vessels of an organ's outer part: of a kidney, whose cortex blood reaches first. A
/// fraction of the blood goes on through the inner part, the medulla, and a fraction of the iodine is
/// filtered into tubules, which run through the cortex and then the medulla. All 0 for other organs.
struct Inner {
    double fraction = 0;                          // of the blood [-]
    double transit = 0;                           // of blood through the inner part [s]
    double filtered = 0;                          // of the iodine [-]
    double outer_tubules = 0, inner_tubules = 0;  // mean times there [s]
};

/// An open end where blood leaves, and the organ behind it; or the end of a tree in another one's vessel, as
/// that of a vertebral artery in the basilar artery.
struct Outlet {
    std::string end, branch, organ;
    int cell;
    int into = -1;             // the cell of another tree that the blood flows into; -1 at an open end
    geometry::Vec3 place;      // [mm]
    geometry::Vec3 direction;  // outward, unit
    double fraction;           // of the flow that enters its tree [-]
    double flow;               // at rest [ml/s]
    double tissue;             // volume that the flow supplies [ml]
    double transit;            // mean, of blood through the organ's small vessels [s]
    double radius = 0;         // of the end [mm]
    double arterial = 0;       // time through the arteries between the end and those vessels [s]
    Inner inner;               // of the organ
    double venous = 0;         // time through the veins behind them that the image shows [s]
};

struct BloodFlow {
    std::vector<FlowCell> cells;
    std::vector<Outlet> outlets;
    struct Source {
        int cell;
        double inflow;  // mean [ml/s]
    };
    std::vector<Source> sources;  // one per tree: trees that are not connected have one each
    /// Of each cell, index into sources; beyond a plug, which no blood comes by, from sources.size() on.
    std::vector<int> tree;
    int cut_off = 0;              // trees beyond plugs
    double mean_pressure = 93;    // at the sources [mmHg]
    std::vector<Lesion> lesions;  // upstream first; they take of the pressure, and nothing of the flow
    /// Of each cell, the part of the mean pressure that obstructions leave; empty = all [-].
    std::vector<double> pressure_left;

    /// The cell one vessel radius downstream of the start of a branch.
    int entry_of(int branch) const;
    /// The cell of a branch whose middle is nearest to a place; -1 for a branch without any.
    int nearest_in(int branch, const geometry::Vec3&) const;
    /// The cell that a point lies deepest in.
    int nearest(const geometry::Vec3&) const;
    /// Mean flow at rest through every cell [ml/s].
    std::vector<double> resting() const;
    /// The flow with that in the way: each end beyond it keeps the part of its fraction that the pressure of
    /// arteries drives by against the bed behind it, whose resistance stays. Other ends keep what they have,
    /// and the source delivers as much less. What is injected beyond a plug goes on, as if it were all.
    BloodFlow obstructed(std::span<const Obstruction>) const;

    /// Flow into each cell from upstream [ml/s], negative where it runs back: the sources' inflow times
    /// `pulse`, with `added` [ml/s] also flowing into each cell. The added flow raises the flow of every end
    /// in proportion to its fraction; the part that the ends beyond do not take runs back toward the source.
    /// `leaving` is the flow out of each outlet.
    void balance(double pulse, std::span<const double> added, std::span<double> into,
                 std::span<double> leaving) const;
};

/// Cuts the centrelines into cells of about `spacing` [mm]. A child's cells begin where it leaves its
/// parent's lumen. Blood runs from the named source, or from the widest end of each tree, to all its other
/// ends; a branch without an end has no flow, and so has a communicating artery (estimate). A root that
/// ends in another tree flows into that. Throws InputError with problems(spec), or
/// for a source that does not exist.
BloodFlow blood_flow(const anatomy::Anatomy&, const FlowSpec& = {}, double spacing = 1.5);

/// Time that blood at rest takes from an end with this radius [mm] and flow [ml/s] to arteries of 0.15 mm
/// radius. In a tree by Murray's law (1926) velocity is proportional to radius, so that every generation, ten
/// radii long (Zamir 1999, coronary arteries: 7 to 12), takes equally long [s].
double arterial_time(double radius, double flow);

/// Contrast passes the arteries behind every end in bins of equal time at rest, and is carried on as fast as
/// the blood leaves the end. What enters is conserved to rounding. Veins behind organs pass it in the same
/// way.
class DistalArteries {
public:
    static constexpr int bins = 24;  // of every end

    explicit DistalArteries(std::span<const Outlet> = {}, double Outlet::*time = &Outlet::arterial);

    /// Takes `entering` [mg] at an outlet while blood leaves it at `flow` [ml/s] for `dt` [s]; returns what
    /// leaves these vessels, as for the organ's smaller ones [mg].
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
