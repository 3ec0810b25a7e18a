#pragma once
/// Measures work by the processor's own clock: time spent waiting for other programs does not count.

#include <ctime>

namespace io {

inline double cpu_seconds(clockid_t clock) {  // [s], from an arbitrary start
    timespec now{};
    clock_gettime(clock, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

inline double thread_cpu_seconds() {
    return cpu_seconds(CLOCK_THREAD_CPUTIME_ID);
}

/// Time of all threads, including those started by libraries.
inline double process_cpu_seconds() {
    return cpu_seconds(CLOCK_PROCESS_CPUTIME_ID);
}

}  // namespace io
