#pragma once
/// What keys, buttons and pedals of the room do, and what of it a guided lesson can practise.

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

namespace script {

/// What a key, a button or a pedal does. The first group acts while held, the second when pressed.
enum class Action : std::uint8_t {
    Advance,
    Withdraw,
    RotateLeft,
    RotateRight,
    LeftAdvance,
    LeftWithdraw,
    LeftRotateLeft,
    LeftRotateRight,
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
    Inflate,
    Deploy,
    // from here on when pressed
    Roadmap,
    AcquisitionMode,
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
    WedgeIn,
    WedgeOut,
    WedgeTurn,
    LungShutter,
    PulsesMore,
    PulsesFewer,
    Device,
    LeftDevice,
    Helper,
    GripCloser,
    GripFarther,
    Deflate,
    NextBalloon,
    Review,
    Pause,
    BackToStart,
    TakeBack,
    Finish,
    Help,
    Instructor,
    Skip,
    Menu
};
inline constexpr int actions = static_cast<int>(Action::Menu) + 1;
inline constexpr Action first_pressed = Action::Roadmap;

/// What a group of keys is for.
enum class Task : std::uint8_t { Hands, Pedals, Stand, Contrast, Treatment, Picture, Exercise };
inline constexpr std::array<std::string_view, 7> task_names = {
    "Hands", "Pedals", "C-arm and table", "Contrast", "Balloon and stent", "Image processing", "Exercise"};

struct ActionInfo {
    std::string_view key;   // in the file
    std::string_view help;  // as shown in the overlay
    Task task;
};
const ActionInfo& info(Action);

/// What a lesson practises: an action, by its number, or one of what has no action.
using Practice = int;
inline constexpr Practice inject_by_hand = actions, inject_by_pump = actions + 1, reach_target = actions + 2;
inline constexpr int practices = actions + 3;
inline constexpr Practice practice(Action action) {
    return static_cast<Practice>(action);
}
/// The names in scenario files: those of the actions, then "inject_by_hand", "inject_by_pump",
/// "reach_target".
std::span<const std::string_view> practice_names();
/// "push", "inject by hand".
std::string_view help_of(Practice);
/// The group of keys that it belongs to.
Task task_of(Practice);

}  // namespace script
