#pragma once
/// Keys of the room: what each does, and how fast hands and stand move. One TOML file holds all of it.
///
///     [hand]
///     advance_mm_per_s = [2, 10, 30]      # fine, plain, fast
///     shift_px = [0.1, 0.5, 2]            # of the mask
///     [keys]
///     advance = ["Up", "W"]               # every action has one or more keys, or none: []
///     [[injection]]
///     key = "F1"
///     name = "5 ml by hand"
///     volume_ml = 5
///     rate_ml_per_s = 2.5
///     into = "aorta"                      # or "device": where its tip is

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "physics/geometry/vec.h"

namespace room {

/// What a key, a button or a pedal does. The first group acts while held, the second when pressed.
enum class Action : std::uint8_t {
    Advance,
    Withdraw,
    RotateLeft,
    RotateRight,
    Fine,
    Fast,
    Fluoroscopy,
    Acquisition,
    ArmLao,
    ArmRao,
    ArmCranial,
    ArmCaudal,
    TableHead,
    TableFeet,
    TableLeft,
    TableRight,
    TableUp,
    TableDown,
    // from here on when pressed
    Roadmap,
    Mask,
    Reference,
    ShiftLeft,
    ShiftRight,
    ShiftUp,
    ShiftDown,
    ShiftAuto,
    ShiftOff,
    Breath,
    SidLess,
    SidMore,
    Magnify,
    Widen,
    Collimate,
    Uncollimate,
    PulsesMore,
    PulsesFewer,
    Device,
    GripCloser,
    GripFarther,
    Review,
    Pause,
    BackToStart,
    TakeBack,
    Finish,
    Help,
    Instructor,
    Menu
};
inline constexpr int actions = static_cast<int>(Action::Menu) + 1;
inline constexpr Action first_pressed = Action::Roadmap;

struct ActionInfo {
    std::string_view key;   // in the file
    std::string_view help;  // as shown in the overlay
};
const ActionInfo& info(Action);

/// A key, as its index in key_names().
using Key = int;
/// Names of all keys that a file may use, on the US layout: "A", "Up", "F1", "LeftShift", "GamepadA".
const std::vector<std::string_view>& key_names();
std::optional<Key> find_key(std::string_view name);

struct InjectionPreset {
    Key key = 0;
    std::string name;
    double volume = 5;    // [ml]
    double rate = 2.5;    // [ml/s]
    double iodine = 320;  // [mg/ml]
    bool through_device = false;
    std::string branch;  // otherwise
};

/// Speeds of hands and stand.
struct Speeds {
    /// A hand starts at this share of its speed, so that one short press is one small step.
    static constexpr double first_share = 0.2;
    /// A hand waits for a device that lags behind by this much [mm], [rad].
    static constexpr double most_behind = 4, most_behind_in_turn = 90 * geometry::degree;
    std::array<double, 3> advance = {2, 10, 30};                       // fine, plain, fast [mm/s]
    std::array<double, 3> rotate = {0.349, 1.571, 4.712};              // [rad/s]
    double run_up = 0.3;                                               // until a hand reaches its speed [s]
    double wheel = 2;                                                  // per notch [mm]
    double drag_advance = 0.15;                                        // per pixel of mouse motion [mm]
    double drag_rotate = 0.00873;                                      // per pixel of mouse motion [rad]
    double dead_zone = 0.15;                                           // of a gamepad's axis [-]
    double arm = 0.436;                                                // [rad/s]
    double table = 60;                                                 // [mm/s]
    std::array<double, 3> shift = {0.1, 0.5, 2};                       // of the mask by a key [pixels]
    double grip_step = 10;                                             // of the hand, from the valve [mm]
    double sid_step = 50;                                              // [mm]
    std::vector<double> fields = {480, 400, 320, 270, 230, 190, 160};  // of the detector, widest first [mm]
};

struct KeyMap {
    Speeds speeds;
    std::array<std::vector<Key>, actions> keys;
    std::vector<InjectionPreset> injections;

    /// All keys of the action: "Up, W"; "no key" where there is none.
    std::string text(Action) const;
    /// The first of its keys: "Up".
    std::string first(Action) const;
};

/// Throws InputError listing all errors with file:line:column: unknown actions and keys, keys given twice,
/// numbers out of range. Actions that are not named keep the keys of `base`, unless another action takes
/// them.
KeyMap parse_keys(const std::string& toml, const std::string& file, const KeyMap& base = {});
KeyMap load_keys(const std::filesystem::path&, const KeyMap& base = {});

}  // namespace room
