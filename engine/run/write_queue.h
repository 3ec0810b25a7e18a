#pragma once
/// Work on files, done in order on a thread of its own.

#include <functional>
#include <memory>

namespace run {

/// At most a few tasks wait, so that a slow disk slows the run down instead of filling the memory.
class WriteQueue {
public:
    WriteQueue();
    /// Waits for what was put in; errors are lost.
    ~WriteQueue();

    /// Throws what an earlier task threw; after such a failure nothing more is done.
    void put(std::function<void()> task);
    /// Returns when all is done. Throws like put. Nothing may be put in later.
    void finish();

private:
    struct Worker;
    std::unique_ptr<Worker> worker_;
};

}  // namespace run
