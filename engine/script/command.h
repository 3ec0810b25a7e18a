#pragma once
/// The actions of a trainee, one command at a time, and scripts of them.
///
///     0       beam on                    # frame, verb, arguments; # starts a comment
///     3       advance 5 mm
///     4..60   advance 2 mm               # at every frame from 4 to 60
///     9       rotate 30 deg
///     20      arm lao 30 deg cranial 10 deg sid 1000 mm
///     25      contrast 12 mg/ml          # fills all vessels evenly, from now on
///     30      inject 12 ml at 6 ml/s into aorta of 300 mg/ml
///     31      inject 6 ml at 3 ml/s through catheter     # or another device that has a lumen
///     32      inject 5 ml at 2 ml/s through introducer       # where the devices enter
///     40      advance catheter 5 mm      # of a device: wire (the default), microcatheter, intermediate,
///                                        # balloon, catheter, sheath, or all of them
///     50      rotate catheter 20 deg
///     55      grip wire 30 mm            # the hand holds it 30 mm from the valve; the default is 100 mm
///     56      pin wire on                # it stays while others move; 'pin wire off': its valve alone holds
///     60      remove wire                # all of it; waits its turn behind earlier motions
///     61      exchange wire amplatzS035  # for another of the catalogue, when it is out; or 'exchange
///     balloon' 62      inflate 8 atm              # the pressure that the inflation device goes to 63
///     deflate 64      deploy                     # the stent: its balloon to nominal pressure, or all of its
///     sheath back 65      retrieve sheath 2 mm       # of a self-expanding stent 66      mode dsa # or live,
///     roadmap, cine 67      mask                       # the next pulse is the mask 68      shift auto #
///     moves the mask onto the image; or 'shift 1.5 -0.5 px', to the right
///                                        # and down, 'shift by 0.5 0 px', 'shift off'
///     38      breath hold                # the patient holds it after breathing out; breath free
///     40      pulse 7.5 per second       # 3.75, 7.5, 15 or 30
///     41      collimate 120 90 mm        # opening at the detector; collimate open
///     41      filter wedge 60 mm 30 deg  # edge from the middle at the detector, covered side from the
///                                        # viewer's right; filter lung; filter wedge out
///     42      table 0 0 -40 mm           # to the patient's left, back, head
///     50      reference                  # the image to the reference screen
///     80      withdraw 10 mm
///     85      teacher target on          # on the trainee's screen; or another of teacher_things, or
///                                        # 'teacher paused': kept for the score, nothing moves by it
///     90      reset                      # everything as at the start
///
/// A teacher's, who makes something happen to the patient; nothing tells the trainee (docs/complications.md):
///
///     40      complication spasm of LRA at 10 mm over 20 mm by 60 percent
///                                        # of the diameter; the middle lies 10 mm along the branch
///     60      complication thrombus in LRA at 15 mm      # or 'at 15 mm over 8 mm'; it lets no blood by
///     80      complication dissection of LRA at 5 mm over 15 mm      # or '... over 15 mm by 50 percent'
///     90      complication breath deep   # the patient breathes deeply, or 'cough', once, or 'free', again
///     120     relieve spasm of LRA       # or dissection of, thrombus in, a branch, or all
///
/// And the end:
///
///     120     end                        # the last frame; default: the hold after the last command
///     state 60 0123456789abcdef          # the state hash that frame 60 must leave
///     comment 60 pulled back too late    # a teacher's, of frame 60: all of the line, which no replay heeds
///
/// A recording begins with lines of its own; the rest of a line is the name:
///
///     recording 3
///     program 0123456789abcdef seldinger 0.1.0
///     scenario 0123456789abcdef renal
///     anatomy 0123456789abcdef
///     learner Ada
///     date 2026-11-26T20:31:05Z          # when the attempt began; of the room's recordings
///
/// Frames stand in order. A line may repeat over a range, and ranges may overlap.

#include <array>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "engine/io/error.h"
#include "physics/geometry/state.h"
#include "physics/geometry/vec.h"
#include "render/xray/c_arm.h"

namespace script {

/// What the hand holds: one of a scenario's devices, which lie in each other in this order, or all of them.
/// A balloon's catheter may carry a stent.
enum class DeviceRole { Wire, Microcatheter, Intermediate, Balloon, Catheter, Sheath, All };
inline constexpr std::array<std::string_view, 7> role_names = {
    "wire", "microcatheter", "intermediate", "balloon", "catheter", "sheath", "all"};
inline constexpr std::string_view name_of(DeviceRole held) {
    return role_names[static_cast<std::size_t>(held)];
}
/// Devices that a scenario can have.
inline constexpr int most_devices = 6;
/// The device, or all, by its name; empty for a name that none has. "both" is an older word for all.
std::optional<DeviceRole> role_named(std::string_view);
/// The names of devices, without "all".
inline constexpr std::span<const std::string_view> device_names() {
    return std::span(role_names).first(most_devices);
}

struct Advance {
    double length = 0;  // [mm]
    DeviceRole held = DeviceRole::Wire;
};
struct Withdraw {
    double length = 0;  // [mm]
    DeviceRole held = DeviceRole::Wire;
};
struct Rotate {
    double angle = 0;  // of the hub, right-handed about the wire [rad]
    DeviceRole held = DeviceRole::Wire;
};
/// The hand holds the shaft at another distance from the valve: closer, it pushes harder before the shaft
/// bows, and turns more directly.
struct Grip {
    double distance = 0;  // [mm]
    DeviceRole held = DeviceRole::Wire;
};
/// Somebody, as a helper, holds a device while others are moved, or lets go of it: then its valve alone does,
/// and it goes along with what drags it by more.
struct Pin {
    bool on = true;
    DeviceRole held = DeviceRole::Wire;  // or another, not All
};
/// Takes a device out.
struct Remove {
    DeviceRole held = DeviceRole::Wire;  // or another, not All
};
/// The wire or the balloon, which is out, becomes another.
struct Exchange {
    std::string device;                  // of the catalogue, or a file
    DeviceRole held = DeviceRole::Wire;  // or Balloon
};
/// The inflation device of the balloon goes to this pressure.
struct Inflate {
    double pressure = 0;  // [atm]
};
struct Deflate {};
/// The stent: its balloon is inflated to nominal pressure, or all of its sheath is retrieved.
struct Deploy {};
/// The sheath over a self-expanding stent is drawn back.
struct RetrieveSheath {
    double length = 0;  // [mm]
};
/// Values that are not given stay as they are.
struct MoveArm {
    std::optional<double> lao, cranial;              // [rad]
    std::optional<double> sid, sod, detector_width;  // [mm]
    std::optional<geometry::Vec3> isocentre;         // [mm]
};
struct Beam {
    bool on = false;
};
struct Contrast {
    double iodine = 0;  // fills the lumen from now on [mg/ml]
};
/// Injects through a device's tip, through the introducer that all devices come in by, or through a flush
/// catheter that lies in a branch, from another access.
struct Inject {
    double volume = 0;    // [ml]
    double rate = 0;      // [ml/s]
    std::string branch;   // the tip lies at its start; empty = through a device, or the introducer
    double iodine = 320;  // [mg/ml]
    DeviceRole through = DeviceRole::Catheter;
    bool introducer = false;  // in place of a device

    bool through_device() const { return branch.empty() && !introducer; }
};
enum class ImagingMode { Live, Dsa, Roadmap, Cine };
inline constexpr std::array<std::string_view, 4> imaging_modes = {"live", "dsa", "roadmap", "cine"};
inline constexpr std::string_view name_of(ImagingMode mode) {
    return imaging_modes[static_cast<std::size_t>(mode)];
}
/// In sentences.
inline constexpr std::string_view title_of(ImagingMode mode) {
    constexpr std::array<std::string_view, imaging_modes.size()> titles = {"fluoroscopy", "DSA", "roadmap",
                                                                           "cine"};
    return titles[static_cast<std::size_t>(mode)];
}
/// Whether its runs are kept, at a dose of their own: an acquisition, as opposed to fluoroscopy.
inline constexpr bool acquires(ImagingMode mode) {
    return mode == ImagingMode::Dsa || mode == ImagingMode::Cine;
}
struct SetMode {
    ImagingMode mode = ImagingMode::Live;
};
struct SetPulseRate {
    double rate = 15;  // [1/s]
};
inline constexpr std::array<double, 4> pulse_rates = {3.75, 7.5, 15, 30};  // [1/s]
bool is_pulse_rate(double);
std::string pulse_rates_text();  // "3.75, 7.5, 15 or 30"
struct NewMask {};
/// Moves the mask of DSA and roadmap: to a place, by a distance, or to where it fits the image best.
struct ShiftMask {
    enum class Mode { To, By, Auto };
    Mode mode = Mode::To;
    double x = 0, y = 0;  // to the right and down [pixels]

    void state(geometry::StateStream& s) { s(mode, x, y); }
};
struct Breathe {
    bool hold = false;
};
struct Collimate {
    double width = 0, height = 0;  // of the opening at the detector [mm]
};
enum class FilterKind { Wedge, Lung };
inline constexpr std::array<std::string_view, 2> filter_names = {"wedge", "lung"};
/// Puts the filter at its place in the beam, or takes it out.
struct SetFilter {
    FilterKind kind = FilterKind::Wedge;
    render::BeamFilter place;
};
/// Position of the table relative to the start [mm].
struct MoveTable {
    geometry::Vec3 place = geometry::Vec3::Zero();
};
/// What a teacher does to the trainee's screen or clock. Nothing moves by it: it is kept so that the score of
/// the attempt can say it.
struct TeacherAct {
    enum class Thing { Target, Way, Hints, Readouts, Reference, Captions, Window, Paused };
    Thing thing = Thing::Target;
    bool on = true;  // shown, or open; of Paused always
};
/// Paused aside, which has no on and off.
inline constexpr std::array<std::string_view, 7> teacher_things = {
    "target", "way", "hints", "readouts", "reference", "captions", "window"};
/// Which of them are shown, or open.
using TeacherScreen = std::array<bool, teacher_things.size()>;
/// Where no teacher has done anything.
inline constexpr TeacherScreen usual_screen = {false, false, true, true, true, true, false};
struct StoreReference {};
struct Reset {};

/// What a teacher makes happen to the patient while a trainee works.
enum class ComplicationKind { Spasm, Thrombus, Dissection, Breath };
inline constexpr std::array<std::string_view, 4> complication_names = {"spasm", "thrombus", "dissection",
                                                                       "breath"};
inline constexpr std::string_view name_of(ComplicationKind kind) {
    return complication_names[static_cast<std::size_t>(kind)];
}
/// The word between a kind and its branch: "spasm of LRA", "thrombus in LRA".
std::string_view preposition(ComplicationKind);
/// How the patient breathes when nobody has told him to hold his breath.
enum class BreathManner { Free, Deep, Cough };
inline constexpr std::array<std::string_view, 3> breath_manners = {"free", "deep", "cough"};
inline constexpr double thrombus_length = 10, dissection_percent = 50;  // where a line names none
/// Of a branch, named as those of an injection, or of the patient's breath.
struct Complicate {
    ComplicationKind kind = ComplicationKind::Spasm;
    std::string branch;  // empty for the breath
    double at = 0;       // its middle, from where the branch leaves its parent's lumen, along it [mm]
    double over = 0;     // its length, half of it on either side of the middle [mm]
    double percent = 0;  // of the diameter that is lost in its middle; of a thrombus 100
    BreathManner breath = BreathManner::Free;
};
/// Takes back what was set, as drugs, aspiration or a stent would.
struct Relieve {
    std::optional<ComplicationKind> kind;  // not Breath; empty = everything, the breath as well
    std::string branch;
};

using Command =
    std::variant<Advance, Withdraw, Rotate, MoveArm, Beam, Contrast, Inject, SetMode, SetPulseRate, NewMask,
                 Collimate, SetFilter, MoveTable, StoreReference, Reset, Remove, Exchange, ShiftMask, Breathe,
                 Grip, Pin, TeacherAct, Complicate, Relieve, Inflate, Deflate, Deploy, RetrieveSheath>;

/// Largest amounts that one command may request; anything beyond is a typing error.
inline constexpr double largest_motion = 500;                // [mm]
inline constexpr double least_grip = 5, largest_grip = 500;  // from the valve [mm]
inline constexpr double largest_rotation = 36000;            // [deg]
inline constexpr double largest_volume = 300;                // of one injection [ml]
using render::widest_opening;                                // of the collimator [mm]
inline constexpr double farthest_filter = 300;               // its edge from the middle, either side [mm]
inline const geometry::Vec3 table_reach(180, 140, 600);      // in either direction [mm]
inline constexpr double largest_shift = 1024;                // of the mask, in either direction [pixels]
inline constexpr double largest_shift_fraction = 0.25;       // the same, of the image's width [-]
/// Of complications: along a branch, their length, and what a spasm or a flap takes of the diameter.
inline constexpr double largest_place = 1000;                                   // [mm]
inline constexpr double shortest_complication = 6, longest_complication = 100;  // [mm]
inline constexpr double least_narrowing = 10, largest_narrowing = 90;           // [percent]
inline constexpr double largest_inflation = 40;  // beyond what any inflation device shows [atm]
inline constexpr int largest_frame = 1'000'000;

/// Whether a teacher gives it, and no hand.
bool is_of_teacher(const Command&);
/// "advance 5 mm": reads back to the same bits.
std::string to_text(const Command&);
/// The command as it is read back from a recording: angles made in radians change by a rounding error.
Command canonical(const Command&);

render::CArm moved(render::CArm, const MoveArm&);

/// The problem with more pulses than frames, for messages.
std::string too_many_pulses(double rate, double frame_rate);

struct TimedCommand {
    int frame = 0;
    Command command;
    io::TextPlace place;  // for messages
};
struct StateCheck {
    int frame = 0;
    std::uint64_t hash = 0;
    io::TextPlace place;
};

/// What a recording says of itself. A hash of 0 is not known.
struct Origin {
    std::string program;   // "seldinger 0.1.0"
    std::string scenario;  // name
    std::string learner;   // empty = nobody's
    std::string patient;   // of the scenario: "2", "seed:17"; empty = the first
    std::uint64_t program_hash = 0, scenario_hash = 0, anatomy_hash = 0;
    bool free_practice = false;  // in the room: without a score, and seconds may have been taken back
    /// Steps of a guided lesson that were done, and those that there are; 0 without one.
    int steps_done = 0, steps = 0;
    std::optional<std::chrono::sys_seconds> date = {};  // when it was begun
};
inline constexpr int recording_schema = 3;
inline constexpr std::size_t longest_learner = 64;  // bytes of UTF-8
/// Whether this can be a learner's name: valid UTF-8, not empty, not too long, without control characters.
bool is_learner(std::string_view);
/// The same for a recording, which an earlier version may have made with a name in another encoding.
bool is_learner_in_file(std::string_view);

/// "2026-11-26T20:31:05Z", and back; empty for what is no time of the years 1970 to 9999.
std::string date_text(std::chrono::sys_seconds);
std::optional<std::chrono::sys_seconds> parse_date(std::string_view);

/// The last line of a signed recording: this, and so many hexadecimal digits.
inline constexpr std::string_view signature_start = "signature ed25519 ";
inline constexpr std::size_t signature_digits = 128;

/// What a teacher says of a frame.
struct Comment {
    int frame = 0;
    std::string text;
};
inline constexpr std::size_t longest_comment = 300;  // bytes of UTF-8
/// Whether this can be a comment's text: valid UTF-8, not blank, not too long, without control characters and
/// without blanks at its ends.
bool is_comment(std::string_view);

/// What the author says of the lines that follow: comments that stand on lines of their own, joined.
struct Caption {
    int frame = 0;  // of the first command after it
    std::string text;
};

struct CommandScript {
    std::string file;
    std::optional<Origin> origin;        // of a recording
    std::vector<TimedCommand> commands;  // in order of frames; ranges expanded
    std::vector<StateCheck> checks;      // in order of frames
    std::vector<Caption> captions;       // in order of lines
    std::vector<Comment> comments;       // in order of frames
    std::optional<int> end;              // last frame, if the script says so

    /// The commands of a frame.
    std::span<const TimedCommand> at(int frame) const;
    /// What is said of a frame; empty where nothing is.
    std::string_view caption_at(int frame) const;
    /// The last frame of the run: `end`, or `tail` frames after the last command or check.
    int last_frame(int tail) const;
};

/// Throws InputError listing all errors, one per line, with file:line:column.
CommandScript parse_commands(std::string_view text, const std::string& file);
CommandScript load_commands(const std::filesystem::path&);

/// The commands of a script that no stand could follow from `start`, that shift the mask beyond a quarter of
/// the image, or that request more pulses than there are frames in a second, a sentence each.
std::vector<std::string> problems(const CommandScript&, const render::CArm& start, double frame_rate);

}  // namespace script
