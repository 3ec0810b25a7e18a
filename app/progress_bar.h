#pragma once
/// Shows the user how far a long piece of work has come.

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fmt/format.h>
#include <functional>
#include <string>
#include <unistd.h>

namespace app {

/// On a terminal one line, rewritten. Where output goes to a file or a pipe, a plain line every few seconds,
/// and none for work that finishes sooner.
class ProgressBar {
public:
    using Clock = std::chrono::steady_clock;

    ProgressBar() : ProgressBar(stderr, isatty(STDERR_FILENO) != 0) {}
    ProgressBar(std::FILE* out, bool terminal, Clock::duration between_lines = std::chrono::seconds(5),
                std::function<Clock::time_point()> now = Clock::now)
        : out_(out), terminal_(terminal), between_lines_(between_lines), now_(std::move(now)) {}
    ~ProgressBar() {
        if (drawn_) std::fputs("\r\033[K", out_);
    }
    ProgressBar(const ProgressBar&) = delete;
    ProgressBar& operator=(const ProgressBar&) = delete;

    /// `part` of the work is done, 0 to 1; `doing` describes the current work for the user.
    void show(double part, const std::string& doing) {
        const auto now = now_();
        if (terminal_)
            draw(part, doing, now);
        else if (part < 1 && now - last_ >= between_lines_) {
            last_ = now;
            put(fmt::format("{}: {:.0f} %\n", doing, 100 * std::clamp(part, 0.0, 1.0)));
            std::fflush(out_);
        }
    }

private:
    /// That it cannot be shown is no reason to end the work.
    void put(const std::string& text) { std::fputs(text.c_str(), out_); }
    void draw(double part, const std::string& doing, Clock::time_point now) {
        if (drawn_ && part < 1 && now - last_ < std::chrono::milliseconds(100)) return;
        last_ = now;
        drawn_ = true;
        const double spent = std::chrono::duration<double>(now - start_).count();
        const auto filled = static_cast<std::size_t>(30 * std::clamp(part, 0.0, 1.0));
        put(fmt::format("\r\033[K[{}{}] {}  {:.0f} s left", std::string(filled, '#'),
                        std::string(30 - filled, '.'), doing, part > 0 ? spent / part * (1 - part) : 0.0));
        std::fflush(out_);
    }

    std::FILE* out_;
    bool terminal_, drawn_ = false;
    Clock::duration between_lines_;
    std::function<Clock::time_point()> now_;
    Clock::time_point start_ = now_(), last_ = start_;
};

}  // namespace app
