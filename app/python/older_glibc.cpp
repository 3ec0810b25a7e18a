/// What g++'s headers, libstdc++.a and libraries of the wheel want and glibc 2.28 or the libstdc++ of g++ 10
/// lack, for the modules of portable wheels (portable.py). What is visible is for those libraries.

#include <cerrno>
#include <cstdint>
#include <ctime>
#include <new>
#include <pthread.h>
#include <sys/random.h>

#define SELDINGER_VISIBLE __attribute__((visibility("default")))

namespace {

/// A time of another clock as one of CLOCK_REALTIME.
int to_real(clockid_t clock, const timespec& until, timespec& limit) {
    timespec here{}, real{};
    if (clock_gettime(clock, &here) != 0 || clock_gettime(CLOCK_REALTIME, &real) != 0) return EINVAL;
    constexpr long second = 1'000'000'000;
    long nanoseconds = until.tv_nsec - here.tv_nsec + real.tv_nsec;
    time_t seconds = until.tv_sec - here.tv_sec + real.tv_sec;
    for (; nanoseconds < 0; nanoseconds += second) --seconds;
    for (; nanoseconds >= second; nanoseconds -= second) ++seconds;
    limit = {seconds, nanoseconds};
    return 0;
}

}  // namespace

extern "C" {

// Of glibc 2.30, for waits with a time limit.
int pthread_cond_clockwait(pthread_cond_t* condition, pthread_mutex_t* mutex, clockid_t clock,
                           const timespec* until) {
    timespec limit{};
    const int wrong = to_real(clock, *until, limit);
    return wrong ? wrong : pthread_cond_timedwait(condition, mutex, &limit);
}
SELDINGER_VISIBLE int pthread_mutex_clocklock(pthread_mutex_t* mutex, clockid_t clock,
                                              const timespec* until) noexcept {
    timespec limit{};
    const int wrong = to_real(clock, *until, limit);
    return wrong ? wrong : pthread_mutex_timedlock(mutex, &limit);
}

/// Of 2.32. Where it is 0, counts of references are atomic, which is always right.
extern char __libc_single_threaded SELDINGER_VISIBLE;
char __libc_single_threaded = 0;

/// Of 2.36, for std::random_device.
uint32_t arc4random() {
    uint32_t number = 0;
    while (getrandom(&number, sizeof number, 0) != sizeof number) {
    }
    return number;
}

// Members of std::exception_ptr, which is a pointer, that g++ 10 has for itself: by its constructor of a copy
// and its destructor.
void copy_exception(void* made, const void* from) asm("_ZNSt15__exception_ptr13exception_ptrC1ERKS0_");
void end_exception(void* one) asm("_ZNSt15__exception_ptr13exception_ptrD1Ev");
SELDINGER_VISIBLE void add_reference(void* self) asm("_ZNSt15__exception_ptr13exception_ptr9_M_addrefEv");
SELDINGER_VISIBLE void release_reference(void* self) asm(
    "_ZNSt15__exception_ptr13exception_ptr10_M_releaseEv");
void add_reference(void* self) {
    void* kept = nullptr;
    copy_exception(&kept, self);
}
void release_reference(void* self) {
    void* given = *static_cast<void**>(self);
    end_exception(&given);
}

/// Of g++ 11.
[[noreturn]] SELDINGER_VISIBLE void throw_bad_array_new_length() asm("_ZSt28__throw_bad_array_new_lengthv");
void throw_bad_array_new_length() {
    throw std::bad_array_new_length();
}
}
