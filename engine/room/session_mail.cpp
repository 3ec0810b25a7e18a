/// What the window's thread gives to a session's and takes from it.

#include <cassert>

#include "engine/room/session.h"

namespace room {

void Session::give(const Input& input, std::optional<Clock::time_point> asked) {
    const std::lock_guard lock(mutex_);
    since_.add(input);
    held_ = {};
    held_.held = input.held;
    held_.push = input.push;
    held_.turn = input.turn;
    if (asked && !asked_) asked_ = asked;
}

void Session::give(Control control) {
    {
        const std::lock_guard lock(mutex_);
        controls_.push_back(control);
    }
    changed_.notify_all();
}

void Session::did(Action deed) {
    {
        const std::lock_guard lock(mutex_);
        deeds_.push_back(deed);
    }
    changed_.notify_all();
}

void Session::give(const exercise::Tuning& tuning) {
    {
        const std::lock_guard lock(mutex_);
        tuning_ = tuning;
    }
    changed_.notify_all();
}

void Session::give_command(const script::Command& command) {
    const std::lock_guard lock(mutex_);
    commands_.push_back(command);
}

void Session::give(const script::Comment& comment) {
    assert(script::is_comment(comment.text));
    {
        const std::lock_guard lock(mutex_);
        comments_.push_back(comment);
    }
    changed_.notify_all();
}

void Session::give(const script::TeacherScreen& screen) {
    const std::lock_guard lock(mutex_);
    screen_ = screen;
}

std::shared_ptr<const View> Session::view() const {
    const std::lock_guard lock(mutex_);
    return view_;
}

std::shared_ptr<const anatomy::Anatomy> Session::anatomy() const {
    const std::lock_guard lock(mutex_);
    return anatomy_;
}

}  // namespace room
