#pragma once
/// What a trainee does, one command at a time, and scripts of it.
///
///     0       beam on                    # frame, verb, arguments; # starts a comment
///     3       advance 5 mm
///     4..60   advance 2 mm               # at every frame from 4 to 60
///     9       rotate 30 deg
///     20      arm lao 30 deg cranial 10 deg sid 1000 mm
///     25      contrast 12 mg/ml
///     80      withdraw 10 mm
///     90      reset                      # everything as at the start
///     120     end                        # the last frame; else the hold of the target after the last
///     command state 60 0123456789abcdef          # the state hash that frame 60 must leave
///
/// Frames stand in order. A line may repeat over a range, and ranges may overlap.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "engine/error.h"
#include "physics/geometry.h"
#include "render/c_arm.h"

namespace engine {

struct Advance {
    double length = 0;
};  // [mm]
struct Withdraw {
    double length = 0;
};  // [mm]
struct Rotate {
    double angle = 0;
};  // of the hub, right-handed about the wire [rad]
/// What is not given stays.
struct MoveArm {
    std::optional<double> lao, cranial;              // [rad]
    std::optional<double> sid, sod, detector_width;  // [mm]
    std::optional<physics::Vec3> isocentre;          // [mm]
};
struct Beam {
    bool on = false;
};
struct Contrast {
    double iodine = 0;
};  // that fills the lumen from now on [mg/ml]
struct Reset {};

using Command = std::variant<Advance, Withdraw, Rotate, MoveArm, Beam, Contrast, Reset>;

/// Amounts that one command may ask for; beyond lies a slip of the pen.
inline constexpr double largest_motion = 500;      // [mm]
inline constexpr double largest_rotation = 36000;  // [deg]
inline constexpr double largest_iodine = 400;      // [mg/ml]
inline constexpr int largest_frame = 1'000'000;

/// "advance 5 mm": reads back to the same bits.
std::string to_text(const Command&);
/// The command as a recording of it will be read: angles made in radians move by a rounding error.
Command canonical(const Command&);

render::CArm moved(render::CArm, const MoveArm&);

struct TimedCommand {
    int frame = 0;
    Command command;
    TextPlace place;  // for messages
};
struct StateCheck {
    int frame = 0;
    std::uint64_t hash = 0;
    TextPlace place;
};

struct CommandScript {
    std::string file;
    std::vector<TimedCommand> commands;  // in order of frames; ranges written out
    std::vector<StateCheck> checks;      // in order of frames
    std::optional<int> end;              // last frame, if the script says so

    /// The last frame of the run: `end`, or `tail` frames after the last command or check.
    int last_frame(int tail) const;
};

/// Throws InputError that lists everything wrong, a line each, with file:line:column.
CommandScript parse_commands(std::string_view text, const std::string& file);
CommandScript load_commands(const std::filesystem::path&);

/// The C-arm commands of a script that no stand could follow from `start`, a sentence each.
std::vector<std::string> problems(const CommandScript&, const render::CArm& start);

}  // namespace engine
