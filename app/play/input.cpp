/// Keys of the trainee's window: those of the window itself, and hands and feet for the session.

#include <algorithm>
#include <imgui.h>
#include <utility>

#include "app/play/play.h"

namespace app {

using room::Action;
using room::Clock;
using room::Phase;

void Play::obey(Action action) {
    switch (action) {
        case Action::Help:
            help_ = !help_;
            break;
        case Action::Menu:
            if (help_)
                help_ = false;
            else if (review_open_)
                review_open_ = false;
            else
                menu_ = !menu_;
            if (session_ && screen_ == Screen::Room)
                session_->give(menu_ ? room::Control::Pause : room::Control::Resume);
            break;
        case Action::Instructor:
            if (teacher_.is_open()) {
                teacher_.close();
                window_.activate();
            } else {
                open_teacher();
            }
            break;
        case Action::Review:
            review_open_ = !review_open_;
            break;
        case Action::Pause:
            if (session_ && view_ && !countdown_) {
                if (view_->phase == Phase::Paused) session_->did(Action::Pause);
                session_->give(running() ? room::Control::Pause : room::Control::Resume);
            }
            break;
        case Action::Skip:
            if (session_) session_->give(room::Control::SkipStep);
            break;
        case Action::TakeBack:
            if (session_) session_->give(room::Control::TakeBack);
            break;
        case Action::Finish:
        case Action::BackToStart:
            ask(action);
            break;
        default:
            break;
    }
}

/// Asks before an attempt ends; of what a script plays nothing is lost.
void Play::ask(Action action) {
    if (!session_ || !view_ || countdown_ || (!running() && view_->phase != Phase::Paused)) return;
    if (session_->options().script) {
        if (action == Action::Finish) session_->give(room::Control::Finish);
        return;
    }
    asking_ = action;
    ran_ = running();
    session_->give(room::Control::Pause);
}

void Play::answer(bool yes) {
    const Action asked = *std::exchange(asking_, {});
    if (yes && asked == Action::Finish) return session_->give(room::Control::Finish);
    if (yes) {
        room::Input input;
        input.pressed.push_back(Action::BackToStart);
        session_->give(input);
    }
    if (yes || ran_) session_->give(room::Control::Resume);
}

void Play::hear_answer(const Events& events) {
    session_->give(room::Input());
    for (const room::Key key : events.pressed) {
        const std::string_view name = room::key_names()[static_cast<std::size_t>(key)];
        const bool yes = name == "Enter" || name == "KeypadEnter" || name == "GamepadA";
        if (yes || name == "Escape" || name == "GamepadB") return answer(yes);
    }
}

/// Handles keys of the window; hands and feet go to the session.
void Play::pass_on(const Events& events) {
    const room::KeyMap& map = options_.keys;
    if (asking_) return hear_answer(events);
    if (screen_ == Screen::Room && session_) {
        const bool hands_free = !menu_ && !review_open_ && !countdown_;
        room::Input input = hands_free ? input_of(events) : room::Input();
        std::optional<Clock::time_point> asked;
        for (const room::Key key : events.pressed) {
            for (int k = 0; k < room::actions; ++k) {
                const auto action = static_cast<Action>(k);
                if (std::find(map.keys[k].begin(), map.keys[k].end(), key) == map.keys[k].end()) continue;
                obey(action);
                if (asking_) return session_->give(room::Input());
                if (hands_free && room::moves_device(action)) asked = events.first_press;
            }
        }
        if (events.wheel != 0 && hands_free) asked = Clock::now();
        session_->give(input, asked);
        return;
    }
    if (ImGui::GetIO().WantTextInput) return;  // a name is being typed
    for (const room::Key key : events.pressed)
        for (const Action action : {Action::Help, Action::Menu, Action::Instructor}) {
            const auto& keys = map.keys[static_cast<int>(action)];
            if (std::find(keys.begin(), keys.end(), key) != keys.end()) obey(action);
        }
}

room::Input Play::input_of(const Events& events) {
    const room::KeyMap& map = options_.keys;
    room::Input input;
    for (int k = 0; k < room::actions; ++k) {
        for (const room::Key key : map.keys[k]) {
            const bool pressed =
                std::find(events.pressed.begin(), events.pressed.end(), key) != events.pressed.end();
            if (window_.holds(key) || pressed) input.held.set(static_cast<std::size_t>(k));
            // What begins a new attempt is asked first.
            if (pressed && static_cast<Action>(k) >= room::first_pressed &&
                static_cast<Action>(k) != Action::BackToStart)
                input.pressed.push_back(static_cast<Action>(k));
        }
    }
    for (const room::Key key : events.pressed)
        for (std::size_t k = 0; k < map.injections.size(); ++k)
            if (map.injections[k].key == key) input.injections.push_back(static_cast<int>(k));
    input.wheel = help_ ? 0 : events.wheel;  // there it scrolls
    used_left_ = used_left_ || input.holds(Action::LeftAdvance) || input.holds(Action::LeftWithdraw);
    input.drag_up = std::exchange(drag_up_, 0);
    input.drag_right = std::exchange(drag_right_, 0);
    input.arm_lao = std::exchange(arm_lao_, 0);
    input.arm_cranial = std::exchange(arm_cranial_, 0);
    input.table_left = std::exchange(table_left_, 0);
    input.table_head = std::exchange(table_head_, 0);
    const Window::Sticks sticks = window_.sticks();
    input.push = sticks.push;
    input.turn = sticks.turn;
    return input;
}

}  // namespace app
