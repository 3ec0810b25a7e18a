#pragma once
/// One wire in one vessel under commands. The state after a frame depends on scenario and commands alone.

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/anatomy/lumen_wall.h"
#include "engine/command.h"
#include "engine/console.h"
#include "engine/contrast_flow.h"
#include "engine/model_choice.h"
#include "engine/scenario.h"
#include "physics/relaxer.h"

namespace engine {

/// What one frame did.
struct StepReport {
    physics::RelaxReport relax;       // of the whole frame
    std::vector<double> insertions;   // change of the inserted length by each motion, in order [mm]
    double rotation = 0;              // Σ|angle| of the hub [rad]
    double turned = 0;                // Σ angle [rad]
    bool withdrawal_stopped = false;  // the curved tip was at the introducer
    bool insertion_stopped = false;   // the tip stands in an open end
    bool whole_wire_is_in = false;    // and more was asked for
    double deepest_crossing = 0;      // of a segment through the wall between its joints, left so [mm]
};

class Simulation {
public:
    /// Loads or draws the vessel, puts the wire in along the entry's centreline and relaxes it.
    /// Throws InputError when scenario and anatomy do not fit: no such end or target, a target outside, a
    /// wire thicker than the vessel at its entry, too much or too little wire inside.
    explicit Simulation(const Scenario&, const ModelCache& = {});
    ~Simulation();
    Simulation(Simulation&&) noexcept;

    /// Motions wait for step(); all else takes effect at once. Throws InputError for an injection into a
    /// branch that does not exist, or beyond the limit of contrast.
    void apply(const Command&);
    /// The commands that apply() would refuse, a sentence each.
    std::vector<std::string> problems(const CommandScript&) const;
    /// Makes the motions that wait, segment by segment, and relaxes with one frame's budget. With the global
    /// relaxer a segment comes in only once the wire is near rest: what the budget does not allow is made in
    /// the frames that follow, in the order it was asked for. A segment at rest that crosses the wall between
    /// its joints, as at a carina, gets a joint there and is relaxed again; before a later motion it is made
    /// whole where it no longer crosses. Segment relaxers are left with their crossings.
    StepReport step();
    /// Everything as after construction, bit for bit.
    void reset();

    const Scenario& scenario() const { return scenario_; }
    /// What was left to choose is as chosen in scenario().
    const ModelChoice& choice() const { return choice_; }
    const Anatomy& anatomy() const { return anatomy_; }
    const physics::Guidewire& wire() const { return wire_; }
    const physics::Vec3& tip_at_start() const { return tip_at_start_; }           // before frame 0 [mm]
    std::span<const physics::WallContact> contacts() const { return contacts_; }  // of the joints as they are
    const physics::Vec3& target() const { return target_; }                       // [mm]
    const Console& console() const { return console_; }
    /// The last step had a pulse of the beam.
    bool pulse() const { return pulse_; }
    double iodine() const { return iodine_; }  // throughout the vessels, injections aside [mg/ml]
    const ContrastFlow& contrast() const { return *contrast_; }
    int frames() const { return frames_; }  // since the start or the last reset
    double time() const;                    // at the end of the last step [s]
    /// Where vessels and wire are now, from where anatomy() and wire() have them [mm].
    physics::Vec3 vessel_shift() const;
    int resets() const { return resets_; }

    double inserted() const { return wire_.inserted_length() + wire_.carried; }  // [mm]
    double tip_to_target() const { return (wire_.tip() - target_).norm(); }      // [mm]

    /// FNV-1a over every bit that later frames depend on, the relaxer's own bookkeeping aside.
    std::uint64_t state_hash() const;

private:
    struct Motion {
        double insertion = 0;  // [mm]
        double rotation = 0;   // [rad]
    };
    void insert(Motion&, int share, StepReport&);
    void turn(Motion&, int share, StepReport&);
    void settle(int share, StepReport&);
    void mend_crossings(int updates, StepReport&);
    physics::RelaxReport relax(physics::Relaxer&, int updates, StepReport&);
    bool tip_has_left() const;
    void locate_target();
    void choose();
    void choose_entry();

    Scenario scenario_;
    Anatomy anatomy_;
    ModelChoice choice_;
    EntryPath entry_;
    physics::Vec3 target_ = physics::Vec3::Zero();
    physics::Vec3 tip_at_start_ = physics::Vec3::Zero();
    int segments_at_start_ = 0;
    std::unique_ptr<const physics::LumenWall> wall_;

    std::unique_ptr<physics::Relaxer> relaxer_;
    std::unique_ptr<physics::Relaxer> passing_;  // between two segments of one frame; global relaxer only
    physics::Guidewire wire_;
    std::vector<physics::WallContact> contacts_;
    std::vector<Motion> waiting_;
    bool settled_ = true;  // near enough to rest for the next motion
    std::unique_ptr<ContrastFlow> contrast_;
    Console console_;
    bool pulse_ = false;
    int frames_ = 0;  // since the start or the last reset
    double iodine_ = 0;
    int resets_ = 0;
};

}  // namespace engine
