#pragma once
/// A world for parts of the product to play in, all of whose accidents one seed decides: which thread and
/// which process goes on, what time it is, which call to the system fails or is the last one of its process.
///
/// The program that has this defines open, write, rename, pthread_mutex_lock, clock_gettime and others of the
/// system's functions in place of libc's, so that the product needs no hooks. One thread of all processes of
/// a world runs at a time; it hands on to another one, by lot, where threads can notice each other.

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace fuzz {

/// What goes wrong from one call for the file system to another one, of those within the world's folder.
struct Fault {
    enum class Kind {
        None,
        Once,      // one call fails, with an error that this call can have
        Kill,      // the process ends by SIGKILL, instead of the call, after it or in the middle of a write
        FullDisk,  // nothing can be made or written; what is there can be removed and renamed
        ReadOnly,  // nothing can be made, written, removed or renamed
    };
    Kind kind = Kind::None;
    std::int64_t from = 0, until = 0;  // calls, counted over all processes
};

struct Accidents {
    std::uint64_t seed = 0;         // of all that is left to chance while they play
    std::array<Fault, 2> faults{};  // the first that applies counts
    int noise = 0;                  // one write in so many is short, or interrupted by a signal; 0 = none
    int switches = 0;  // one place in so many where threads can notice each other hands on; 0 = none
    int jumps = 0;     // one look at the clock in so many finds it put forward or back; 0 = none
    int processors = 1;
    double begin = 1.6e9;  // [s since 1970]
};

/// What a process leaves.
struct Ended {
    enum class How { Done, Refused, Threw, Killed };
    How how = How::Done;
    std::string said;                   // by the exception
    std::vector<std::uint64_t> states;  // that it told
    std::string broken;                 // a signal, a hang, or threads that wait for each other; empty = none
};
struct Played {
    std::vector<Ended> processes;
    std::int64_t calls = 0;    // for the file system
    std::string log;           // a line for each thing that went wrong, without numbers of processes
    bool left_behind = false;  // something could not be removed: the product may have left it behind
};

class FaultWorld {
public:
    explicit FaultWorld(std::filesystem::path folder);
    ~FaultWorld();
    FaultWorld(const FaultWorld&) = delete;
    FaultWorld& operator=(const FaultWorld&) = delete;

    /// Plays each in a process of its own, all at a time.
    Played play(const Accidents&, const std::vector<std::function<void()>>&);
    /// To be called by what is played.
    static void tell_state(std::uint64_t);

private:
    std::filesystem::path folder_;
    int next_process_;
};

}  // namespace fuzz
