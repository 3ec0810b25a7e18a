#include "engine/episode/pool.h"

#include <atomic>
#include <condition_variable>
#include <exception>
#include <fmt/format.h>
#include <mutex>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <unistd.h>

namespace episode {

script::Command feed(double length, script::DeviceRole held) {
    if (length < 0) return script::Withdraw{-length, held};
    return script::Advance{length, held};
}

void append(script::DeviceRole held, double advance, double rotate, std::vector<script::Command>& commands) {
    if (advance != 0) commands.push_back(feed(advance, held));
    if (rotate != 0) commands.push_back(script::Rotate{rotate, held});
}

struct Pool::State {
    const pid_t process = getpid();
    std::vector<std::thread> threads;
    std::mutex mutex;
    std::condition_variable begun, ended;
    std::uint64_t round = 0;
    int busy = 0;
    bool stops = false;
    // Of the round.
    const std::function<void(int, int)>* work = nullptr;
    int count = 0;
    std::atomic<int> next = 0;
    int failed = -1;  // lowest index that threw
    std::exception_ptr error;

    void stop() {
        {
            const std::lock_guard lock(mutex);
            stops = true;
        }
        begun.notify_all();
        for (std::thread& thread : threads) thread.join();
    }
    /// Whether this is a process that was forked since: it has none of the threads.
    bool forked() const { return getpid() != process; }

    void take(int thread) {
        for (int index; (index = next.fetch_add(1)) < count;) {
            try {
                (*work)(index, thread);
            } catch (...) {
                const std::lock_guard lock(mutex);
                if (failed < 0 || index < failed) {
                    failed = index;
                    error = std::current_exception();
                }
            }
        }
    }
    void serve(int thread) {
        for (std::uint64_t seen = 0;;) {
            {
                std::unique_lock lock(mutex);
                begun.wait(lock, [&] { return stops || round != seen; });
                if (stops) return;
                seen = round;
            }
            take(thread);
            const std::lock_guard lock(mutex);
            if (--busy == 0) ended.notify_one();
        }
    }
};

Pool::Pool(int threads) : state_(std::make_unique<State>()) {
    if (threads < 1) throw std::invalid_argument("a pool has one thread or more");
    try {
        for (int thread = 1; thread < threads; ++thread)
            state_->threads.emplace_back([state = state_.get(), thread] { state->serve(thread); });
    } catch (const std::system_error&) {
        const int started = this->threads();
        state_->stop();
        throw std::runtime_error(
            fmt::format("expected {} threads, found no room for more than {} within the limits of memory and "
                        "processes (ulimit -v, -u)",
                        threads, started));
    }
}

Pool::~Pool() {
    if (state_->forked()) {
        // Threads that are not there cannot be joined.
        static_cast<void>(state_.release());
        return;
    }
    state_->stop();
}

int Pool::threads() const {
    return static_cast<int>(state_->threads.size()) + 1;
}

void Pool::run(int count, const std::function<void(int, int)>& work) {
    State& s = *state_;
    {
        const std::lock_guard lock(s.mutex);
        s.work = &work;
        s.count = count;
        s.next = 0;
        s.failed = -1;
        s.error = nullptr;
        s.busy = s.forked() ? 0 : static_cast<int>(s.threads.size());
        ++s.round;
    }
    s.begun.notify_all();
    s.take(0);
    std::unique_lock lock(s.mutex);
    s.ended.wait(lock, [&] { return s.busy == 0; });
    s.work = nullptr;
    if (s.error) std::rethrow_exception(s.error);
}

}  // namespace episode
