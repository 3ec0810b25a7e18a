/// What Mesa's rasteriser needs of the process that it works in.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <malloc.h>
#include <stdexcept>
#include <string>
#include <sys/mman.h>
#include <sys/resource.h>
#include <thread>
#include <unistd.h>

#include "render/picture/gl_source.h"

namespace render::gl_source {
namespace {

/// Whether an earlier context of this program was made by the process that this one was forked from.
bool forked() {
    static const pid_t first = getpid();
    return getpid() != first;
}

void refuse_if_forked() {
    if (forked())
        throw std::runtime_error(
            "images cannot be made in a process that was forked from one that had made some, because the "
            "rasteriser's threads are not there; start the process anew ('spawn' in Python)");
}

constexpr std::size_t megabyte = 1'000'000;

std::size_t limit_of(__rlimit_resource what) {
    struct rlimit limit {};
    return ::getrlimit(what, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY ? limit.rlim_cur : 0;
}

/// What the rasteriser takes to begin with: LLVM, targets, and the stacks of its threads [bytes].
std::size_t needed_to_begin() {
    constexpr std::size_t most_threads = 32, others = 3;  // Mesa's limit; of its caches
    const std::size_t threads = std::min<std::size_t>(most_threads, std::thread::hardware_concurrency());
    const std::size_t stack = std::max(limit_of(RLIMIT_STACK), 8 * megabyte);
    return 96 * megabyte + (threads + others) * (std::min(stack, 64 * megabyte) + megabyte);
}

/// The rasteriser ends the program where it gets no memory, so that it is asked for before, where there is a
/// limit.
void require_memory(std::size_t bytes) {
    const std::size_t limit = limit_of(RLIMIT_AS);
    if (limit == 0) return;
    // Else each thread of the rasteriser reserves 64 MB when it begins, also of what was found to be free
    // here.
    static const int once = ::mallopt(M_ARENA_MAX, 1);
    static_cast<void>(once);
    void* const trial = ::mmap(nullptr, bytes, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (trial == MAP_FAILED)
        throw std::runtime_error("images: expected " + std::to_string(bytes / megabyte) +
                                 " MB more of address space for the rasteriser, found a limit of " +
                                 std::to_string(limit / megabyte) + " MB in all (ulimit -v)");
    ::munmap(trial, bytes);
}

/// To be called when a context was made. At the end of a process that was forked since, the rasteriser would
/// wait for ever for its threads, so such a process ends before the rasteriser is asked.
void end_forks_early() {
    static const int once = on_exit(
        [](int status, void*) {
            if (!forked()) return;
            std::fflush(nullptr);
            _exit(status);
        },
        nullptr);
    static_cast<void>(once);
}

}  // namespace

void require_usable(Moment moment) {
    refuse_if_forked();
    // Shaders are compiled as they are first drawn with.
    require_memory(moment == Moment::First ? needed_to_begin() : 48 * megabyte);
}

void made() {
    end_forks_early();
}

bool is_of_this_process() {
    return !forked();
}

}  // namespace render::gl_source
