#pragma once
/// Keys of the room: what each does, and how fast hands and stand move. One TOML file holds all of it.
///
///     [hand]
///     advance_mm_per_s = [2, 10, 30]      # fine, plain, fast
///     shift_px = [0.1, 0.5, 2]            # of the mask
///     mouse = "right"                     # the hand that wheel and drag are, or "left"
///     [keys]
///     advance = ["Up", "W"]               # every action has one or more keys, or none: []
///     [[injection]]
///     key = "F1"
///     name = "coronary"                   # shown before what it gives; may be left out
///     by = "hand"                         # or "pump"
///     volume_ml = 5
///     rate_ml_per_s = 2
///     into = "device"                     # through it, or "introducer", or a branch such as "aorta"
///
/// Keys are named by their places on a US keyboard; labels() shows what the user's own has there.

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/script/action.h"
#include "physics/geometry/vec.h"

namespace room {

using script::Action;
using script::ActionInfo;
using script::actions;
using script::first_pressed;
using script::info;
using script::Task;
using script::task_names;

enum class Side : std::uint8_t { Right, Left };
inline constexpr std::array<Side, 2> sides = {Side::Right, Side::Left};
inline constexpr std::array<std::string_view, 2> side_names = {"right", "left"};
inline constexpr std::string_view name_of(Side side) {
    return side_names[static_cast<std::size_t>(side)];
}
/// What moves the device in a hand: push, pull, turn to the left, turn to the right, take another one.
inline constexpr std::array<std::array<Action, 5>, 2> actions_of_hands = {
    {{Action::Advance, Action::Withdraw, Action::RotateLeft, Action::RotateRight, Action::Device},
     {Action::LeftAdvance, Action::LeftWithdraw, Action::LeftRotateLeft, Action::LeftRotateRight,
      Action::LeftDevice}}};
/// Whether a key of this action moves a device.
inline constexpr bool moves_device(Action action) {
    return action <= Action::LeftRotateRight;
}

/// A key, as its index in key_names().
using Key = int;
/// Names of all keys that a file may use, on the US layout: "A", "Up", "F1", "LeftShift", "GamepadA".
const std::vector<std::string_view>& key_names();
std::optional<Key> find_key(std::string_view name);
/// What is shown for a key: what stands on it in the keyboard's layout, if it has a letter or sign that the
/// panel's fonts have (Latin, Greek); letters in capitals, small signs by name ("Period"). Otherwise its
/// name; keys of the keypad, whose signs others have too, and Space keep theirs.
std::string label_of(std::string_view name, std::string_view in_layout);

struct InjectionPreset {
    enum class By { Hand, Pump };
    enum class Site { Device, Introducer, Branch };
    Key key = 0;
    std::string name;  // may be empty
    By by = By::Hand;
    double volume = 5;    // [ml]
    double rate = 2;      // [ml/s]
    double iodine = 320;  // [mg/ml]
    Site site = Site::Branch;
    std::string branch;  // of that way: a catheter lies there, from another access
};

/// "pump: 20 ml at 20 ml/s", after its name if it has one.
std::string sentence_of(const InjectionPreset&);

/// What a hand gives with a syringe. Angiographers' means through 6 to 8 F catheters are 2.1 ml/s of 7.1 ml
/// into left and 1.7 ml/s of 4.8 ml into right coronary arteries (Dodge et al., Cathet Cardiovasc Diagn
/// 1998;44:34); the most of a strong hand, and of its syringe, is an estimate.
inline constexpr double largest_hand_rate = 5, largest_hand_volume = 20;  // [ml/s], [ml]
/// The syringe of an angiographic injector (estimate) [ml].
inline constexpr double largest_pump_volume = 150;

/// Speeds of hands and stand.
struct Speeds {
    /// A hand starts at this fraction of its speed, so that one short press is one small step.
    static constexpr double first_fraction = 0.2;
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
    Side mouse = Side::Right;         // the hand that the mouse is
    std::vector<std::string> labels;  // what is shown for each key; empty = their names

    std::string label(Key) const;
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
