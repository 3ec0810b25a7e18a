#pragma once
/// Contrast in the blood: it is injected, carried along the vessels, dispersed on the way, blushes in the
/// organs behind the open ends, and drains. Plain arithmetic; the state depends on the calls alone.

#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "engine/blood/blood_flow.h"
#include "engine/blood/bore.h"
#include "physics/geometry/state.h"

namespace blood {

/// Contrast allowed for one patient: 5 ml per kg of body weight over serum creatinine in mg/dl, at most 300
/// ml (Cigarroa 1989) [ml]. `weight` [kg], `creatinine` [mg/dl].
double contrast_limit(double weight, double creatinine);

/// What an injection passes before it reaches blood: the bore of a device, of the introducer, or of a flush
/// catheter. It is full of saline until the first injection; that saline comes out first, and contrast stays
/// behind until it is flushed.
struct Line {
    int number = 0;    // by which it is led()
    double bore = 0;   // what it holds [ml]
    double flush = 0;  // saline that flows through it after an injection [ml/s]
};

/// A hand or power injection at a steady rate until the volume is given.
struct Injection {
    /// A branch, by its name or the start of its name: injects into its beginning. Or a place, such as a
    /// catheter's tip: injects where the vessels are nearest to it [mm].
    std::variant<std::string, geometry::Vec3> at;
    double rate = 5.0;              // [ml/s]
    double volume = 10.0;           // [ml]
    double iodine = 300.0;          // [mg/ml]
    std::optional<Line> line = {};  // empty = straight into the blood
};

/// Contrast in the small vessels behind an end.
struct Blush {
    double iodine = 0;         // [mg]
    double concentration = 0;  // averaged over the outlet's tissue [mg/ml]
    double inner = 0;          // the part of `iodine` in the organ's inner part, a kidney's medulla [mg]

    void state(geometry::StateStream& s) { s(iodine, concentration, inner); }
};

/// Where the iodine is [mg]; injected = in_lines + in_vessels + in_organs + drained + leaked. The arteries
/// beyond the ends count as the organs'. What has left an organ is drained; of that, `in_veins` is still in
/// veins near it.
struct IodineBalance {
    double injected = 0, in_lines = 0, in_vessels = 0, in_organs = 0, drained = 0, leaked = 0, in_veins = 0;
};

/// A hole in the wall, and what has gone through it into the tissue, where it stays.
struct Hole {
    int cell = -1;                                    // of the BloodFlow
    geometry::Vec3 place = geometry::Vec3::Zero();    // in vessels that nothing moves [mm]
    geometry::Vec3 outward = geometry::Vec3::Zero();  // unit, out of the vessel
    double diameter = 0;                              // of what made it [mm]
    double blood = 0;                                 // [ml]
    double iodine = 0;                                // [mg]

    void state(geometry::StateStream& s) { s(cell, place, outward, diameter, blood, iodine); }
};

/// Blood through a hole that a round end of this diameter [mm] has made, by the law of an orifice:
/// Q = C a A √(2 p / ρ), with C = 0.6 of a sharp edge, the mean arterial pressure p [mmHg] against none in
/// the tissue, and ρ = 1060 kg/m³. A is the end's section; the elastic wall closes behind it to a
/// quarter of that, a = 0.25 (estimate) [ml/s].
double leak_rate(double diameter, double mean_pressure);

/// Finite volumes on the cells of a BloodFlow. Blood with contrast moves by a second-order upwind scheme with
/// van Leer's limiter, then spreads by implicit diffusion: no concentration is ever below 0 or above the
/// injected one, and iodine is conserved to rounding. An injection mixes with the passing blood; the excess
/// over what the vessel takes runs back upstream. Behind an end the iodine passes
/// the arteries to the organ, where a chain of three mixed volumes delays it by the organ's transit time
/// before it drains. In a kidney that chain is the cortex; a part of what leaves its first volume stays in
/// tubules, a part of what leaves its second passes the medulla. Contrast does not recirculate.
class ContrastFlow {
public:
    /// Throws InputError as blood_flow does.
    explicit ContrastFlow(const anatomy::Anatomy&, const FlowSpec& = {});

    const BloodFlow& blood() const { return blood_; }
    /// The same without what is in the way of blood.
    const BloodFlow& unobstructed() const { return free_ ? *free_ : blood_; }
    std::span<const geometry::Vec3> nodes() const { return nodes_; }  // middle of each cell [mm]
    std::span<const float> radii() const { return radii_; }           // [mm]
    std::span<const float> iodine() const { return shown_; }          // in each cell [mg/ml]
    std::span<const Blush> blush() const { return blush_; }           // behind each outlet of blood()
    /// How unevenly contrast is mixed across each cell: the relative gradient of its concentration over the
    /// cell's radius, 1 at most, perpendicular to the vessel; empty where all is well mixed. Only vessels
    /// wider than 6 mm are uneven. Gravity draws contrast, denser than blood, to the back of a patient who
    /// lies supine, as far as blood runs slowly: Ri / (1 + Ri) with the bulk Richardson number Ri = g Δρ/ρ d
    /// / v² (layers persist above ¼: Miles 1961, Howard 1961) at the flow of rest and injection. Contrast
    /// from a catheter's tip stays on the tip's side, less by a factor e every 8 diameters (estimate).
    std::vector<Eigen::Vector3f> streams() const;
    /// In the arteries beyond the ends, which the wire cannot enter: DistalArteries::bins for each outlet of
    /// blood() [mg/ml].
    std::span<const float> distal_iodine() const { return distal_.iodine(); }
    /// In the veins behind the organs, likewise [mg/ml]. What a kidney filters is not in it.
    std::span<const float> venous_iodine() const { return veins_.iodine(); }

    /// Begins with the next step, in addition to running injections. Throws InputError for numbers out of
    /// range, a branch that does not exist, and a volume beyond the limit, stating what is left of it.
    void inject(const Injection&);
    /// The cell that an injection into a branch goes into. Throws InputError where there is no such branch.
    int entry_of(const std::string& branch) const;
    /// Where a line ends now, and what it holds [ml]. One that nothing was injected through is ignored.
    void lead(int line, const geometry::Vec3& end, double bore);
    bool was_used(int line) const { return used(line) != nullptr; }
    /// Mean concentration in a line at equal parts of its length, from hub to end [mg/ml]; empty where there
    /// is no contrast in it.
    std::vector<float> in_line(int line, int parts) const;
    /// What flows out of a line's end in the last step: concentration [mg/ml] and flow [ml/s].
    struct Outflow {
        double iodine = 0, flow = 0;
        void state(geometry::StateStream& s) { s(iodine, flow); }
    };
    Outflow out_of_line(int line) const;
    /// Makes a hole in the wall nearest to a place, through which blood leaks from the next step on, as much
    /// as leak_rate says and at most half of what flows into that tree; where there is one within its width,
    /// the larger remains. `outward`: unit, out of the vessel.
    void pierce(const geometry::Vec3& place, const geometry::Vec3& outward, double diameter);
    std::span<const Hole> holes() const { return holes_; }
    /// From the next step on this is in the way of blood; nothing else that was. No part of the state. A
    /// vessel before a plug, through which nothing flows, is stirred by the pulse: contrast spreads into it.
    void obstruct(std::span<const Obstruction>);
    /// `dt` [s], 0 or more.
    void step(double dt);
    /// Restores the state after construction, bit for bit.
    void reset();

    bool injecting() const { return !running_.empty(); }
    double injection_rate() const;                 // of all running injections [ml/s]
    double time_left() const;                      // until the last of them ends [s]
    double injected() const { return injected_; }  // so far [ml]
    double left() const;                           // of the limit, counting running injections in full [ml]
    IodineBalance balance() const;
    void state(geometry::StateStream& s) {
        s(time_, injected_, injected_iodine_, drained_, running_, iodine_, distal_, tanks_, blush_, shown_,
          site_, inner_);
        s.unless_empty(holes_);
        s.unless_empty(lines_);
        s.unless_empty(through_);
        s.beside(veins_);  // follows from what drains, and nothing else follows from it
    }

private:
    struct Running {
        int cell;
        double rate, left, iodine;  // [ml/s], [ml], [mg/ml]
        void state(geometry::StateStream& s) { s(cell, rate, left, iodine); }
    };
    /// Of the last injection from a place.
    struct Site {
        int cell = -1;
        geometry::Vec3 aside = geometry::Vec3::Zero();  // from the cell's middle, in radii
        void state(geometry::StateStream& s) { s(cell, aside); }
    };
    /// A line that was used.
    struct Used {
        int number = 0, cell = 0;
        Bore bore;
        double flush = 0, to_flush = 0, waits = 0;  // [ml/s], [ml], [s]
        Outflow out;
        void state(geometry::StateStream& s) { s(number, cell, bore, flush, to_flush, waits, out); }
    };
    Used* used(int line);
    const Used* used(int line) const;
    Site site_at(const geometry::Vec3& place, int cell) const;
    void inject_and_flush(double dt);
    void advance(double dt);
    void carry(double dt);
    void spread(double dt);
    void perfuse(double dt);
    void leak(double pulse, double dt);
    void show();
    double pulse(double time) const;

    FlowSpec spec_;
    BloodFlow blood_;
    std::optional<BloodFlow> free_;  // while there is something in the way: the flow without it
    std::vector<double> stirred_;    // into each cell and back, of vessels before a plug; empty = none [ml/s]
    std::vector<std::string> branches_;
    std::vector<geometry::Vec3> nodes_;
    std::vector<float> radii_, shown_;
    std::vector<int> upstream_, only_child_;  // of each cell; the latter -1 at ends and junctions
    std::vector<double> volume_;              // of each cell [ml]

    double time_ = 0;
    double injected_ = 0, injected_iodine_ = 0, drained_ = 0;  // [ml], [mg], [mg]
    std::vector<Running> running_;
    std::vector<int> through_;  // the line of each of running_, -1 = none; empty while no line was used
    std::vector<Used> lines_;
    Site site_;
    std::vector<Hole> holes_;
    std::vector<double> resting_;  // flow through each cell [ml/s]
    std::vector<double> iodine_;   // in each cell [mg/ml]
    struct Tanks {
        double mass[3] = {0, 0, 0};  // [mg]
        void state(geometry::StateStream& s) { s(mass[0], mass[1], mass[2]); }
    };
    /// Of an outlet whose organ has an inner part [mg].
    struct InnerTanks {
        double vessels[2] = {0, 0}, outer_tubules = 0, inner_tubules = 0;
        double held() const { return vessels[0] + vessels[1] + outer_tubules + inner_tubules; }
        void state(geometry::StateStream& s) { s(vessels[0], vessels[1], outer_tubules, inner_tubules); }
    };
    DistalArteries distal_;
    std::vector<Tanks> tanks_;  // behind each outlet
    std::vector<InnerTanks> inner_;
    std::vector<Blush> blush_;

    // Of one step.
    std::vector<double> into_, leaving_, added_, added_iodine_, outflow_, change_, diagonal_, right_;
    std::vector<double> reached_;  // what entered each organ [mg]
    std::vector<double> leaking_;  // through each hole [ml/s]

    DistalArteries veins_;  // behind the organs
};

}  // namespace blood
