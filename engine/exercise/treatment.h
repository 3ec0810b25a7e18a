#pragma once
/// What is done to narrow places: a balloon opens them, a stent keeps them open. The laws of one place are in
/// physics/wall/opening.h; what is left out, and the sources, are in docs/treatment.md.

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/anatomy/anatomy.h"
#include "engine/blood/blood_flow.h"
#include "engine/exercise/branch_stretch.h"
#include "engine/scenario/scenario.h"
#include "physics/geometry/state.h"
#include "physics/wall/narrowed_wall.h"
#include "physics/wall/opening.h"
#include "physics/wire/chain.h"

namespace exercise {

/// A balloon or a stent's sheath, as it is when it is prepared: folded.
struct Inflation {
    std::string device;     // its name in the catalogue, or its file
    double pressure = 0;    // on the dial [atm]
    double wanted = 0;      // to which it is on its way [atm]
    double uncovered = 0;   // of the stent, by its sheath [mm]
    double to_uncover = 0;  // what is asked for [mm]
    bool burst = false;
    bool deployed = false;           // its stent has begun to leave it
    std::vector<double> radii = {};  // of the balloon at each of its samples, as of physics::Bulge [mm]
    /// What an inflated balloon leaves its catheter of the lumen around it: a tube along the vessel's axis,
    /// as much narrower than the lumen as the balloon is wider than folded.
    std::vector<physics::Narrowing::Sample> sleeve = {};
    int plugs = -1;  // branch of the anatomy in which it lets no blood by; -1 = none
    geometry::Vec3 plug = geometry::Vec3::Zero();  // where [mm]

    bool inflated() const { return !burst && pressure > 0; }
    bool operator==(const Inflation&) const = default;
    void state(geometry::StateStream& s) {
        s(device, pressure, wanted, uncovered, to_uncover, burst, deployed, radii, sleeve, plugs, plug);
    }
};

/// A lesion of the scenario, as it is now.
struct Lesion {
    int spec = 0;                              // of Scenario::lesions
    int branch = 0;                            // of the anatomy
    std::vector<physics::OpenedPlace> places;  // at the samples of its BranchStretch

    bool operator==(const Lesion&) const = default;
    void state(geometry::StateStream& s) { s(spec, branch, places); }
};

/// A stent in the vessel: what of it has been deployed.
struct PlacedStent {
    /// Every millimetre from the distal end on.
    struct Sample {
        geometry::Vec3 at = geometry::Vec3::Zero();  // of its axis [mm]
        physics::OpenedPlace place;                  // of the vessel around it
        int lesion = -1, lesion_place = 0;           // where it lies in a lesion, whose place counts
        bool operator==(const Sample&) const = default;
        void state(geometry::StateStream& s) { s(at, place, lesion, lesion_place); }
    };
    std::string device;
    scenario::Stent spec;
    int frame = 0;         // of the attempt, at which its deployment began
    bool attached = true;  // its balloon is in it and inflated, or its sheath has not come off
    std::vector<Sample> samples;

    bool operator==(const PlacedStent& other) const {
        return device == other.device && frame == other.frame && attached == other.attached &&
               samples == other.samples;
    }
    void state(geometry::StateStream& s) { s(device, spec, frame, attached, samples); }
};

/// What happened to the vessel or the device.
struct TreatmentEvent {
    enum class Kind { Burst, Dissection, Rupture, Deployed };
    static constexpr std::array<std::string_view, 4> names = {"burst", "dissection", "rupture", "deployed"};
    Kind kind = Kind::Burst;
    int frame = 0;                                  // of the attempt
    double pressure = 0;                            // [atm]
    double ratio = 0;                               // of the vessel's diameter to what it was without plaque
    int branch = -1;                                // of the anatomy
    double along = 0;                               // from the branch's origin [mm]
    geometry::Vec3 place = geometry::Vec3::Zero();  // [mm]
    geometry::Vec3 outward = geometry::Vec3::Zero();  // unit, out of the vessel
    double volume = 0;                                // of contrast that has left a balloon [ml]

    std::string_view name() const { return names[static_cast<std::size_t>(kind)]; }
    void state(geometry::StateStream& s) {
        s(kind, frame, pressure, ratio, branch, along, place, outward, volume);
    }
};

/// What has happened, in words for the room.
std::string sentence(const TreatmentEvent&, const anatomy::Anatomy&);

/// Of all inflations of an attempt.
struct InflationTally {
    int inflations = 0;
    double seconds = 0;        // above 1 atm [s]
    double beyond_rated = 0;   // [s]
    double highest = 0;        // [atm]
    double occluded = 0;       // in which a balloon let no blood by [s]
    double longest = 0;        // of these, without a break [s]
    double without_break = 0;  // now [s]
    double largest_ratio = 0;  // of a vessel on which an inflated balloon presses to it without plaque [-]
    void state(geometry::StateStream& s) {
        s(inflations, seconds, beyond_rated, highest, occluded, longest, without_break, largest_ratio);
    }
};

class Treatment {
public:
    static constexpr double inflation_rate = 2;  // by the handle's turns (estimate) [atm/s]
    static constexpr double sheath_speed = 4;    // [mm/s]
    static constexpr double fastest = 2;         // of a lumen's wall as it is opened (estimate) [mm/s]
    static constexpr double largest_move = 0.2;  // of a lumen's or a balloon's wall in a frame [mm]
    /// Balloons burst at this multiple of their rated pressure, below which makers vouch that 999 of 1000 do
    /// not.
    static constexpr double bursts_at = 1.25;
    static constexpr double iodine_in_balloon = 150;  // contrast and saline in equal parts [mg/ml]
    /// Ratios of diameters from which a wall is torn, and torn through.
    static constexpr double dissects_at = 1.3, dissects_calcified_at = 1.2, ruptures_at = 1.5;

    /// The problems with a scenario's lesions in these vessels and with what its tray has, a sentence each,
    /// with where the file says so.
    static std::vector<std::string> problems(const scenario::Scenario&, const anatomy::Anatomy&);

    /// Everything as before the treatment.
    void start(const scenario::Scenario&, const anatomy::Anatomy&);
    /// After the device with the balloon became another, by that name in the catalogue or of a file.
    void take(const std::string& device);
    /// Whether there is something to treat, or something to treat with.
    bool given() const { return !lesions_.empty() || !inflation_.empty(); }

    /// Why that can't be done now; empty where it can. `chain`: where the balloon, device `which` of it,
    /// lies.
    std::string problem_with_inflation(double pressure, const physics::Chain&, int which,
                                       const scenario::Device&) const;
    std::string problem_with_sheath(const physics::Chain&, int which, const scenario::Device&) const;
    std::string problem_with_motion() const;
    void inflate(double pressure) { inflation_.front().wanted = pressure; }
    void retrieve(double length) { inflation_.front().to_uncover += length; }

    /// By a frame of `seconds`; `balloon`: place of the device in the chain, -1 without one. Whether
    /// something has changed that vessels or devices feel. New events are the last of events().
    bool step(double seconds, int frame, const physics::Chain&, int balloon, const scenario::Device*,
              const blood::BloodFlow&, const anatomy::Anatomy&);
    /// What the balloon makes of its device.
    std::vector<physics::Bulge> bulge(const scenario::Device&) const;

    std::vector<physics::Narrowing> narrowings() const;
    std::vector<blood::Obstruction> obstructions() const;
    /// With radii in steps of 0.1 mm, as an image shows them.
    Treatment as_seen() const;

    std::span<const Lesion> lesions() const { return lesions_; }
    /// Whether no lesion has lost more of its diameter than this, with no balloon inflated [percent].
    bool has_opened(double residual) const;
    const BranchStretch& stretch_of(const Lesion& lesion) const {
        return stretches_[static_cast<std::size_t>(&lesion - lesions_.data())];
    }
    std::span<const PlacedStent> stents() const { return stents_; }
    const Inflation* inflation() const { return inflation_.empty() ? nullptr : &inflation_.front(); }
    std::span<const TreatmentEvent> events() const { return events_; }
    const InflationTally& tally() const { return tally_; }
    /// Whether a balloon is on its way to be folded, or to a lower pressure.
    bool deflates() const {
        return inflation() && (inflation()->wanted < inflation()->pressure ||
                               (inflation()->pressure == 0 && !inflation()->sleeve.empty()));
    }
    /// Whether a balloon lets no blood by.
    bool occluded() const { return inflation() && inflation()->plugs >= 0; }

    /// Makes again what follows from scenario and anatomy.
    void find_places(const scenario::Scenario&, const anatomy::Anatomy&);
    bool same_lumen(const Treatment& other) const { return lesions_ == other.lesions_; }
    void state(geometry::StateStream&);

private:
    class Along;
    void change_pressure(double seconds, const Along&, int frame);
    bool move_lesions(const Along&, double most);
    bool move_stents(const Along&, double most);
    bool fill_balloon(const Along&, const blood::BloodFlow&, const anatomy::Anatomy&, int frame);
    void place_stent(const Along&, const blood::BloodFlow&, int frame);
    void add_sample(PlacedStent&, const Along&, double arc, double radius, const blood::BloodFlow&);
    bool lay_sleeve(const Along&, const anatomy::Anatomy&, int branch);
    void count(double seconds, const scenario::Device&);
    std::optional<std::pair<int, int>> lesion_at(const Along&, double arc) const;
    const physics::StentLaw* stent_in(int lesion, int place) const;
    void tear(const TreatmentEvent&, double dissects_at);

    std::vector<Lesion> lesions_;
    std::vector<PlacedStent> stents_;
    std::vector<Inflation> inflation_;  // of the balloon device; none or one
    std::vector<TreatmentEvent> events_;
    InflationTally tally_;

    // Follow from scenario and anatomy, or are of one step.
    std::vector<BranchStretch> stretches_;  // of lesions_
    std::vector<std::vector<double>>
        arcs_;  // of their places along the chain; NaN where it does not pass [mm]
    std::vector<scenario::LesionSpec> specs_;
};

}  // namespace exercise
