#include "engine/script/action.h"

#include <cassert>

namespace script {
namespace {

constexpr std::array<ActionInfo, actions> table = {{
    {"advance", "push", Task::Hands},
    {"withdraw", "pull", Task::Hands},
    {"rotate_left", "turn the hub to the left", Task::Hands},
    {"rotate_right", "turn the hub to the right", Task::Hands},
    {"left_advance", "left hand: push", Task::Hands},
    {"left_withdraw", "left hand: pull", Task::Hands},
    {"left_rotate_left", "left hand: turn the hub to the left", Task::Hands},
    {"left_rotate_right", "left hand: turn the hub to the right", Task::Hands},
    {"fine", "slow hands", Task::Hands},
    {"fast", "fast hands", Task::Hands},
    {"fluoroscopy", "pedal: fluoroscopy, or roadmap", Task::Pedals},
    {"acquisition", "pedal: run of DSA or cine", Task::Pedals},
    {"arm_lao", "C-arm to LAO", Task::Stand},
    {"arm_rao", "C-arm to RAO", Task::Stand},
    {"arm_cranial", "C-arm to cranial", Task::Stand},
    {"arm_caudal", "C-arm to caudal", Task::Stand},
    {"table_head", "table toward the head", Task::Stand},
    {"table_feet", "table toward the feet", Task::Stand},
    {"table_left", "table to the patient's left", Task::Stand},
    {"table_right", "table to the patient's right", Task::Stand},
    {"table_up", "table up", Task::Stand},
    {"table_down", "table down", Task::Stand},
    {"inflate", "1 atm more in the balloon; held, 2 atm a second", Task::Treatment},
    {"deploy", "stent: balloon to nominal pressure, or 2 mm of its sheath back", Task::Treatment},
    {"roadmap", "roadmap on and off", Task::Pedals},
    {"acquisition_mode", "acquisition pedal: DSA or cine", Task::Pedals},
    {"mask", "new mask of DSA", Task::Picture},
    {"reference", "image to the reference screen", Task::Picture},
    {"shift_left", "mask to the left", Task::Picture},
    {"shift_right", "mask to the right", Task::Picture},
    {"shift_up", "mask up", Task::Picture},
    {"shift_down", "mask down", Task::Picture},
    {"shift_auto", "mask to where it fits the image best", Task::Picture},
    {"shift_off", "mask to where it was taken", Task::Picture},
    {"breath", "hold the breath, or breathe", Task::Pedals},
    {"sid_less", "detector nearer", Task::Stand},
    {"sid_more", "detector farther", Task::Stand},
    {"magnify", "smaller field", Task::Stand},
    {"widen", "larger field", Task::Stand},
    {"collimate", "collimator closer", Task::Stand},
    {"uncollimate", "collimator wider", Task::Stand},
    {"wedge_in", "wedge filter farther in", Task::Stand},
    {"wedge_out", "wedge filter farther out", Task::Stand},
    {"wedge_turn", "turn the filter by 30 degrees: the wedge, or else the lung shutter", Task::Stand},
    {"lung_shutter", "lung shutter in and out", Task::Stand},
    {"pulses_more", "more pulses a second", Task::Pedals},
    {"pulses_fewer", "fewer pulses a second", Task::Pedals},
    {"device", "the next device in the right hand", Task::Hands},
    {"left_device", "the next device in the left hand", Task::Hands},
    {"helper", "helper: takes it from the right hand, lets go, holds", Task::Hands},
    {"grip_closer", "right hand closer to the valve", Task::Hands},
    {"grip_farther", "right hand farther from the valve", Task::Hands},
    {"deflate", "balloon: deflate", Task::Treatment},
    {"next_balloon", "the next balloon or stent of the tray, once this one is out", Task::Treatment},
    {"review", "look at the runs taken", Task::Picture},
    {"pause", "pause", Task::Exercise},
    {"back_to_start", "a new attempt from the start", Task::Exercise},
    {"take_back", "take back the last 10 s (free practice)", Task::Exercise},
    {"finish", "end the exercise", Task::Exercise},
    {"help", "this help", Task::Exercise},
    {"instructor", "the teacher's window", Task::Exercise},
    {"skip", "guided lesson: leave out this step", Task::Exercise},
    {"menu", "menu", Task::Exercise},
}};

constexpr std::array<ActionInfo, practices - actions> without_action = {
    {{"inject_by_hand", "inject with a syringe", Task::Contrast},
     {"inject_by_pump", "inject with the injector", Task::Contrast},
     {"reach_target", "bring the tip to the target and hold it there", Task::Exercise}}};

const ActionInfo& info_of(Practice practice) {
    assert(practice >= 0 && practice < practices);
    return practice < actions ? table[practice] : without_action[practice - actions];
}

}  // namespace

const ActionInfo& info(Action action) {
    return table[static_cast<int>(action)];
}

std::span<const std::string_view> practice_names() {
    static const auto names = [] {
        std::array<std::string_view, practices> made;
        for (Practice k = 0; k < practices; ++k) made[k] = info_of(k).key;
        return made;
    }();
    return names;
}

std::string_view help_of(Practice practice) {
    return info_of(practice).help;
}

Task task_of(Practice practice) {
    return info_of(practice).task;
}

}  // namespace script
