#pragma once
/// How far a long piece of work is, for whoever waits at a terminal.

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fmt/format.h>
#include <string>
#include <unistd.h>

namespace app {

/// One line on a terminal, rewritten; nothing where it would end up in a file.
class ProgressBar {
public:
    ProgressBar() : shown_(isatty(STDERR_FILENO) != 0) {}
    ~ProgressBar() {
        if (drawn_) std::fputs("\r\033[K", stderr);
    }
    /// `part` of the work is done, 0 to 1; `told` says what a user wants to know of it.
    void show(double part, const std::string& told) {
        if (!shown_) return;
        const auto now = Clock::now();
        if (part < 1 && now - last_ < std::chrono::milliseconds(100)) return;
        last_ = now;
        drawn_ = true;
        const double spent = std::chrono::duration<double>(now - start_).count();
        const auto filled = static_cast<std::size_t>(30 * std::clamp(part, 0.0, 1.0));
        fmt::print(stderr, "\r\033[K[{}{}] {}  {:.0f} s left", std::string(filled, '#'),
                   std::string(30 - filled, '.'), told, part > 0 ? spent / part * (1 - part) : 0.0);
        std::fflush(stderr);
    }

private:
    using Clock = std::chrono::steady_clock;
    bool shown_ = false, drawn_ = false;
    Clock::time_point start_ = Clock::now(), last_ = start_ - std::chrono::seconds(1);
};

}  // namespace app
