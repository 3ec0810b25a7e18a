#pragma once
/// Devices on one centreline in vessels, under commands. The state after a frame depends on scenario and
/// commands alone.

#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "engine/blood/contrast_flow.h"
#include "engine/exercise/complications.h"
#include "engine/exercise/console.h"
#include "engine/exercise/injury.h"
#include "engine/exercise/lines.h"
#include "engine/exercise/outside.h"
#include "engine/exercise/treatment.h"
#include "engine/scenario/breathing.h"
#include "engine/scenario/model_choice.h"
#include "engine/scenario/motion_field.h"
#include "engine/scenario/scenario.h"
#include "engine/scenario/vessel_give.h"
#include "engine/script/command.h"
#include "physics/geometry/mesh_query.h"
#include "physics/geometry/state.h"
#include "physics/relax/discretisation_error.h"
#include "physics/relax/hub.h"
#include "physics/relax/relaxer.h"
#include "physics/wire/drag.h"
#include "physics/wire/friction.h"
#include "render/xray/contrast.h"

namespace exercise {

/// What came of the motions of one frame.
struct MotionFlags {
    bool withdrawal_stopped = false;  // no more than the last two segments are inside
    bool past_vessel_end = false;     // the tip has left the vessels that are known by one of their ends
    bool whole_wire_is_in = false;    // and more was asked for
    bool settling = false;            // the wire is on its way to rest: the one shown is the last at rest
    bool buckled = false;             // a push was not passed on, or hardly: the shaft outside bows
    bool refused = false;             // a motion that led to no rest was not made
    bool too_thick = false;           // a catheter stands before a vessel that is narrower than it is

    void state(geometry::StateStream& s) {
        s(withdrawal_stopped, past_vessel_end, whole_wire_is_in, settling, buckled, refused, too_thick);
    }
};

/// What one frame did.
struct StepReport : MotionFlags {
    physics::RelaxReport relax;           // of the whole frame
    std::vector<double> insertions;       // change of the inserted length by each motion, in order [mm]
    double rotation = 0;                  // Σ|angle| of the hubs [rad]
    double deepest_crossing = 0;          // depth of a segment left in the wall between its joints [mm]
    std::string exchanged;                // the wire is now this one
    std::string denied;                   // what was not done, and why: one sentence
    std::vector<TreatmentEvent> treated;  // new ones
    /// Of each shaft that is another model from now on: what it is and what that leaves out, a sentence.
    std::vector<std::string> torsions;
    std::string vessels;           // the same, of vessels that make way from now on, or stay
    double waiting_insertion = 0;  // Σ|length| asked for but not made yet [mm]
    double waiting_rotation = 0;   // Σ|angle| [rad]
    bool reset = false;            // a new attempt began with this frame
    int injuries = 0;              // new ones: the last of Simulation::injuries()
    ConsoleEvents console;
    scenario::Breathing::Event breath = scenario::Breathing::Event::None;
};

/// What a hand has done to a device and feels of it. The load is that of the wire shown, the last at rest:
/// while the wire is on its way to rest, it stays. 0 by the paper's relaxers, which know none.
struct Hand {
    double turned = 0;  // Σ angle of the hub since the attempt began [rad]
    physics::HubLoad load;
    double bow = 0;  // what it has fed that has not gone in: the shaft outside has bowed [mm]

    void state(geometry::StateStream& s) { s(turned, load, bow); }
};

/// What became another model since the attempt began.
struct ModelChanges {
    int count = 0;        // of shafts
    int vessels = 0;      // that make way from then on, or stay
    double released = 0;  // energy of the chain that the changes cost on the way to rest, friction's aside;
                          // < 0 where they added some [N·mm]
    /// Before the last change, of which the chain is still on its way to rest [N·mm].
    std::optional<double> energy;

    void state(geometry::StateStream& s) { s(count, vessels, released, energy); }
};

/// What the last frame left to be read. No later state depends on it.
struct Readings {
    std::vector<Hand> hands;     // on each device, innermost first
    bool at_rest = true;         // the wire shown is an equilibrium within the solver's tolerance
    bool strict_minimum = true;  // and a strict minimum of the energy
    MotionFlags motion;
    bool waits = false;  // some motion was asked for and not made yet

    void state(geometry::StateStream& s) { s(hands, at_rest, strict_minimum, motion, waits); }
};

/// What an instructor may change while the wire is inside.
struct Tuning {
    double shaft_rigidity = 250, tip_rigidity = 6;  // EI of the wire [N·mm²]
    double segment_length = 2;                      // λ [mm]
    double wall_stiffness = 5;                      // k of each joint of that λ [N/mm]
    double friction = 0;                            // μ of the wire, before the wall scales it [-]
    physics::RelaxerConfig relaxer;
};

class Simulation {
public:
    /// Loads or draws the vessel, puts the wire in along the entry's centreline and relaxes it.
    /// Throws InputError when scenario and anatomy do not fit: no such end or target, a target outside, a
    /// wire thicker than the vessel at its entry, too much or too little wire inside; and for problems() of
    /// the script, if there is one, before the wall's distance field is made.
    explicit Simulation(const scenario::Scenario&, const anatomy::ModelCache& = {},
                        const script::CommandScript* = nullptr);
    /// Another simulation in the same state. Both share anatomy and wall, which never change: each may be
    /// used by a thread of its own.
    Simulation(const Simulation&);
    ~Simulation();
    Simulation(Simulation&&) noexcept;
    Simulation& operator=(const Simulation&) = delete;

    /// Motions wait for step(); all else takes effect at once. Throws InputError for an injection into a
    /// branch that does not exist, or beyond the limit of contrast, and for a complication that these vessels
    /// cannot have; those of vessels need the global relaxer.
    void apply(const script::Command&);
    /// The commands that apply() would reject, a sentence each.
    std::vector<std::string> problems(const script::CommandScript&) const;
    /// Makes the waiting motions and relaxes, with one frame's budget. With the global relaxer motion is
    /// continuous: every part of it, at most half a segment's length where there is friction, ends at rest
    /// before the next is made. What the budget does not allow waits for later frames, in the order it was
    /// asked for. Where the budget ends on the way to rest, as in a snap, the wire shown stays at its last
    /// rest until it has arrived: what is shown and scored is always an equilibrium. A segment at rest that
    /// crosses the wall between its joints, as at a carina, gets a joint there and is relaxed again; before a
    /// later motion it is made whole where it no longer crosses. With a stated error of the tip segments are
    /// split and merged at rest by its estimate, as far as the budget goes. Segment relaxers end where the
    /// budget does and keep their crossings.
    StepReport step();
    /// Restores everything as after construction, bit for bit; after retune(), with what that changed.
    void reset();

    Tuning tuning() const;
    /// Continues as if the scenario had these values: the wire is laid anew where it lies, with the same
    /// length and turn, and brought to rest. Waiting motions are dropped. Throws InputError for values that
    /// the scenario could not have, and then changes nothing.
    void retune(const Tuning&, const anatomy::ModelCache& = {});
    /// Sets another target in the same vessels. Throws InputError for a target that does not exist or lies
    /// outside, and then changes nothing.
    void aim(const scenario::Target&);

    const scenario::Scenario& scenario() const { return scenario_; }
    /// What `auto` stood for: scenario() has every such value replaced by this choice, but for torsion, which
    /// is decided anew whenever a device is to move.
    const scenario::ModelChoice& choice() const { return choice_; }
    /// What the shaft of a device is now, and what that leaves out. With the global relaxer.
    physics::Torsion torsion(int device) const { return physics::torsion_of(wire_.devices[device]); }
    scenario::TorsionNeed torsion_need(int device) const;
    std::string torsion_sentence(int device) const;
    const ModelChanges& model_changes() const { return model_changes_; }
    /// Whether the vessels stay where they are, as far as the devices have come.
    bool vessels_stay() const { return !wall_->foundation() || wire_.vessels_stay; }
    /// How far the devices push vessels aside, or can where they come next without more of a push: what
    /// vessels that stay leave out. 0 where nothing is known of what they lie in.
    scenario::VesselGive vessel_give(double enough = std::numeric_limits<double>::infinity()) const;
    /// That, and what the vessels do: a sentence; empty where they cannot move.
    std::string vessels_sentence() const;
    const anatomy::Anatomy& anatomy() const { return *anatomy_; }
    const physics::NarrowedWall& wall() const { return *wall_; }
    /// The chain of joints, on which all devices lie.
    const physics::Chain& wire() const { return wire_; }
    /// Those that are used now, innermost first: the scenario's, or a wire that took the place of its wire.
    std::span<const scenario::PlacedDevice> devices() const { return devices_; }
    const geometry::Vec3& tip_at_start() const { return tip_at_start_; }          // before frame 0 [mm]
    std::span<const physics::WallContact> contacts() const { return contacts_; }  // of the joints as they are
    const geometry::Vec3& target() const { return target_; }                      // [mm]
    const Console& console() const { return console_; }
    double iodine() const { return iodine_; }  // throughout the vessels, injections aside [mg/ml]
    const blood::ContrastFlow& contrast() const { return *contrast_; }
    /// Of the attempt. With the paper's relaxers, whose frames need not end at rest, there are none.
    const Injuries& injuries() const { return injuries_; }
    /// Set by a teacher in the attempt, in order; those that are set() are there now.
    std::span<const Complication> complications() const { return complications_.all(); }
    const Treatment& treatment() const { return treatment_; }
    int frames() const { return frames_; }  // since the start or the last reset
    double time() const;                    // at the end of the last step [s]
    const scenario::Breathing& breathing() const { return breathing_; }
    double breath() const;  // fraction of the way to the end of a quiet inspiration [-]
    /// Displacement of vessels and wire as a whole now, from where anatomy() and wire() have them [mm].
    geometry::Vec3 vessel_shift() const;
    /// Where a place that anatomy() and wire() have is now, with the heart's and the breath's motion there.
    geometry::Vec3 place_now(const geometry::Vec3&) const;
    /// Axis of a stent now, which goes with its vessel [mm].
    geometry::Polyline axis_now(const PlacedStent&) const;

    /// How far besides vessel_shift() the vessels are where devices have pushed them and a heart has carried
    /// them, at each node of contrast() and at each node of the distal arteries of the image, which go with
    /// the end before them; empty = nowhere [mm].
    struct VesselMoves {
        std::vector<Eigen::Vector3f> of_nodes, of_distal;
    };
    VesselMoves vessel_moves() const;
    /// The same at each vertex of the lumen [mm].
    std::vector<Eigen::Vector3f> lumen_moves() const;
    /// Where complications make the lumen narrower than its mesh. While they come and go it changes a few
    /// times only, for the image has to be made anew.
    const std::vector<render::VertexMove>& narrowed_lumen() const;
    /// How far the foremost tip and the largest force on the wall are from those of infinitely short
    /// segments, and which segments cause it, if asked for. Made anew by each call, at the cost of a part of
    /// a push. Empty unless the wire shown is a strict minimum, and where no estimate is possible.
    std::optional<physics::DiscretisationError> tip_error(bool by_segment = false) const;
    /// Against the lumen's mesh; made when first asked for, by tens of milliseconds, and shared by copies.
    const geometry::MeshQuery& lumen_query() const;
    /// The farthest that a joint has pushed a vessel [mm].
    double farthest_vessel_move() const;

    /// Length of a device inside, as shown; 0 for one that is not there [mm].
    double inserted(script::DeviceRole = script::DeviceRole::Wire) const;
    /// Where the device ends, and the direction there.
    struct Tip {
        geometry::Vec3 at, along;
    };
    Tip tip_of(script::DeviceRole) const;
    /// From the introducer to where the device ends; empty where it is not inside [mm].
    geometry::Polyline path_of(script::DeviceRole) const;
    /// The same where a heart has carried it, vessel_shift() aside: a device that is stiff for its vessel
    /// follows the mean of what moves a few centimetres of it.
    geometry::Polyline carried_path_of(script::DeviceRole) const;
    /// Of the device that the exercise is about.
    geometry::Vec3 tip() const;
    double tip_to_target() const { return (tip() - target_).norm(); }  // [mm]
    /// What the hand feels, and what came of the last frame: the one source of panel, trace, State and
    /// `serve`.
    const Readings& readings() const { return readings_; }
    Hand hand(script::DeviceRole) const;  // all 0 for a device that is not there
    /// Distance of the hand from the valve; empty for a device that is not there, and with the paper's
    /// relaxers, which know no shaft outside [mm].
    std::optional<double> gripped_at(script::DeviceRole) const;
    /// Push that the shaft of a device, of this place in the list, passes on: under a larger one it bows
    /// between hand and introducer [N]. Infinity with the paper's relaxers.
    double passes_on(int device = 0) const;
    /// Largest flow of contrast through a device, with what is in its lumen where it is [ml/s].
    double largest_flow(script::DeviceRole = script::DeviceRole::Catheter) const;
    double largest_flow_of_introducer() const;  // around the devices in it [ml/s]

    /// What lies in the bore of a device, and the length of the bore, from the hub, that it lies in.
    struct Bore {
        double inner = 0, inside = 0;  // diameter and length [mm]
    };
    Bore bore_of(int device) const;

    /// What stands in the beam besides the devices: the introducer, then flush catheters, which stay where
    /// they are from the start, or from their first injection on.
    struct Standing {
        StillTube tube;
        int line = 0;  // of contrast()
    };
    std::span<const Standing> standing() const { return standing_; }
    /// Contrast that leaves the end of a device or the introducer now: what of, and where and whither.
    struct Jet {
        Tip from;
        double bore = 0;  // diameter [mm]
        blood::ContrastFlow::Outflow out;
    };
    std::vector<Jet> jets() const;

    /// Everything that later frames depend on: two simulations of one scenario with the same state never
    /// diverge.
    void state(geometry::StateStream&);
    std::uint64_t state_hash() const { return geometry::state_hash_of(*this); }

private:
    struct Motion {
        double insertion = 0;  // [mm]
        double rotation = 0;   // [rad]
        int device = physics::every_device;
        bool removes = false;       // the device, whatever is inside
        std::string exchange = {};  // for this device
        bool dragged = false;       // by friction, and by no hand
        bool released = false;      // by the bow of the shaft outside, and by no hand
        double goes_in = 1;         // of what the hand feeds by the part under way; the rest bows the shaft
        bool by_hand() const { return !dragged && !released; }
        void state(geometry::StateStream& s) {
            s(insertion, rotation, device, removes, exchange, dragged, released, goes_in);
        }
        bool done() const { return insertion == 0 && rotation == 0 && !removes && exchange.empty(); }
    };
    struct Apply;
    std::optional<physics::Foundation::Displacement> displacement() const;
    static std::vector<Eigen::Vector3f> moved(const physics::Foundation&,
                                              const physics::Foundation::Displacement&,
                                              std::span<const geometry::Vec3> places,
                                              std::vector<int>& stations);
    void make_relaxers();
    void lay(const geometry::Polyline&, const physics::Chain* before = nullptr);
    int device_of(script::DeviceRole) const;
    void inject_through(const script::Inject&);
    void inject_by(const physics::DeviceSpec&, double inner, double inside, int line,
                   std::variant<std::string, geometry::Vec3> at, const script::Inject&);
    double widest_inside() const;
    const Standing& flush_catheter_in(const std::string& branch);
    std::vector<geometry::Vec3> carried() const;
    void stand_tubes();
    geometry::Vec3 led_to(const Tip&) const;
    void lead_lines();
    void exchange_device(Motion&, StepReport&);
    bool stands_before_a_narrow_vessel(int device) const;
    double allowed_feed(const Motion&, StepReport&) const;
    // For a frame with the global relaxer.
    void move_hub(StepReport&);
    void prepare_motion(StepReport&);
    bool make_motion(Motion&, StepReport&);
    void take_in_hand(const Motion&);
    std::vector<physics::HubLoad> shaft_loads() const;  // of what is between hands and introducer
    void balance();
    bool drag_along();
    int shaft_of(const Motion&) const;
    int fed_by_hand(const Motion&) const;
    void bear(const Motion&, double feed);
    bool bow_out(Motion&, double feed);
    void refuse(Motion&, const physics::HubReport&, StepReport&);
    void refuse_push(Motion&, double part, StepReport&);
    void grip(int device, double distance);
    void pin(int device, bool on);
    void place_devices();
    void account(const physics::HubReport&, StepReport&);
    void mend_crossings(StepReport&);
    void keep_tip_error(StepReport&);
    void show();
    bool is_lost() const;
    void show_rest(StepReport&);
    void change_vessels(StepReport&);
    void settle_changed(StepReport&);
    void go_back(StepReport&);
    void take_up_changes();
    // Of balloons and stents.
    int balloon() const;  // place in the list of devices, -1 = none
    void inflate(double pressure);
    void deploy();
    void retrieve_sheath(double length);
    void prepare_balloon(physics::Chain&) const;
    bool treat();
    physics::Chain among_unmoved_vessels() const;
    void follow_events(std::size_t from, StepReport&);
    void relieve_stented();
    void keep_readings(const StepReport&);
    int look_for_injuries();
    // For a frame with a segment relaxer.
    void move_segments(StepReport&);
    void feed_segments(Motion&, int fraction, StepReport&);
    void turn(Motion&, int fraction, StepReport&);
    void relax(int updates, StepReport&);
    physics::Chain& chain() { return hub_ ? moving_ : wire_; }
    const physics::Chain& chain() const { return hub_ ? moving_ : wire_; }
    // Of shafts.
    bool twists_by_segments(const physics::Device* before) const;
    scenario::ShaftState shaft(int device) const;
    bool renew_torsion(std::vector<std::string>* said);
    void know_vessels();
    bool vessels_can_stay() const;
    bool renew_vessels(std::string* said);
    scenario::VesselGive pushed_now() const;
    void renew_models(StepReport&);
    void count_released();
    double energy() const;
    void count_turn(int device, double angle);
    bool hub_is_idle() const { return !hub_ || !hub_->working(); }
    int frame_updates() const;
    int updates_left(const StepReport&) const;
    bool may_begin(const StepReport&, int things = 1) const;
    bool tip_has_left() const;

    scenario::Scenario scenario_;
    std::shared_ptr<const anatomy::Anatomy> anatomy_;
    struct LumenQuery {
        std::once_flag once;
        std::optional<geometry::MeshQuery> query;
    };
    std::shared_ptr<LumenQuery> lumen_query_ = std::make_shared<LumenQuery>();
    scenario::ModelChoice choice_;
    anatomy::EntryPath entry_;
    geometry::Vec3 target_ = geometry::Vec3::Zero();
    geometry::Vec3 tip_at_start_ = geometry::Vec3::Zero();
    std::shared_ptr<physics::NarrowedWall> wall_;
    std::shared_ptr<const scenario::Reach> reach_;
    mutable std::optional<scenario::VesselGives> gives_;  // none where vessels cannot move

    std::unique_ptr<physics::Hub> hub_;          // of the global relaxer
    std::unique_ptr<physics::Relaxer> relaxer_;  // of segments
    physics::Chain wire_;                        // as it is shown
    physics::Chain moving_;                      // as the hub works on it
    std::vector<physics::WallContact> contacts_;
    std::vector<Motion> waiting_;
    double deepest_crossing_ = 0;  // of the wire shown [mm]
    int rounds_of_mending_ = 0;    // since the last motion
    int rounds_of_refining_ = 0;   // the same of segments that keep a stated error of the tip
    double usual_work_ = 0;        // of a motion's part, a mean of the last ones [updates]
    int part_work_ = 0;            // of the part under way [updates]
    physics::DragSearch drags_;    // for what no hand holds
    Outside outside_;              // for what hands hold
    double push_before_ = 0;       // on the shaft fed, before the part under way [N]
    std::unique_ptr<blood::ContrastFlow> contrast_;
    std::optional<scenario::MotionField> motion_;
    std::vector<Standing> standing_;
    std::vector<std::string> flushed_;  // branches that flush catheters have been put into in the attempt
    Console console_;
    int frames_ = 0;  // since the start or the last reset
    scenario::Breathing breathing_;
    double iodine_ = 0;
    Injuries injuries_;
    Complications complications_;
    Treatment treatment_;
    ModelChanges model_changes_;
    Readings readings_;
    bool was_reset_ = false;      // since the last step
    std::string denied_;          // since the last step
    std::string exchanged_name_;  // of the wire that is used now; empty = the scenario's
    std::vector<scenario::PlacedDevice> devices_;
    std::vector<int> pinned_otherwise_;  // devices: than the scenario says; in order
    // In the foundation, once asked for: of contrast()'s nodes, and of the lumen's vertices.
    mutable std::vector<int> node_stations_, vertex_stations_;
    // The lumen's moves, and what they were made of.
    mutable std::vector<render::VertexMove> narrowed_lumen_;
    mutable std::vector<Complication> narrowed_by_;
    mutable Treatment opened_by_;
};

}  // namespace exercise
