#pragma once
/// Many episodes at once on a pool of threads. What each does depends on its own commands alone.

#include <functional>
#include <memory>
#include <vector>

#include "engine/episode/episode.h"

namespace episode {

/// Advances by a length, or withdraws where it is below 0 [mm]: scripts know no negative lengths.
script::Command feed(double length, script::DeviceRole);

/// Adds the commands of a device's motion [mm], [rad], of which zero asks for none.
void append(script::DeviceRole, double advance, double rotate, std::vector<script::Command>&);

class Pool {
public:
    /// `threads` ≥ 1, the caller's among them.
    explicit Pool(int threads);
    ~Pool();
    Pool(const Pool&) = delete;
    Pool& operator=(const Pool&) = delete;

    int threads() const;
    /// Calls work(index, thread) for every index below count, each once, by some thread; returns when all
    /// have ended. When calls throw, throws what the one of the lowest index threw, after all have ended. In
    /// a process that was forked since the pool was made, the calling thread does all.
    void run(int count, const std::function<void(int index, int thread)>& work);

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace episode
