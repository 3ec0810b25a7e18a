#pragma once
/// Work of the calling thread by the processor's own clock: waiting for other programs does not count.

#include <ctime>

namespace engine {

inline double thread_cpu_seconds() {  // [s], from an arbitrary start
    timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace engine
