#include "tests/fuzz/fault_world.h"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <climits>
#include <csignal>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <dlfcn.h>
#include <exception>
#include <fcntl.h>
#include <fmt/format.h>
#include <link.h>
#include <linux/futex.h>
#include <new>
#include <pthread.h>
#include <stdexcept>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/sysinfo.h>
#include <sys/wait.h>
#include <unistd.h>

#include "engine/io/error.h"

namespace fuzz {
namespace {

constexpr int most_threads = 64, most_processes = 4, most_states = 4096, first_process = 5'000'000;
constexpr std::int64_t never = LLONG_MAX;
constexpr unsigned most_work = 120, longest_play = 1800;  // [s] of the processor, and in all

/// A thread of one of the processes.
struct Thread {
    bool runs = false;
    int process = 0;
    pthread_t handle = 0;
    const void* waits_for = nullptr;  // null: it can go on
    std::int64_t until = never;       // and then it can, too [ns]
    std::atomic<std::uint32_t> turn = 0;
};

struct Process {
    bool runs = false, killed = false, stuck = false;
    Ended::How how = Ended::How::Killed;
    int states = 0;
    std::uint64_t state[most_states];
    char said[8192];
};

/// In memory that all its processes share. Only the thread whose turn it is uses it; so does the one that
/// started them while none of them runs.
struct Shared {
    Accidents accidents;
    char folder[512];
    std::uint64_t random = 0;
    std::int64_t now = 0, shift = 0;  // [ns]; what the clock on the wall is ahead of the other one
    std::int64_t calls = 0;
    int turn = -1, first_process = 0;
    bool left_behind = false;
    Thread threads[most_threads];
    Process processes[most_processes];
    std::size_t logged = 0;
    char log[1 << 16];
};

Shared* shared = nullptr;
thread_local int me = -1;  // −1: a thread outside of the world

bool inside() {
    return me >= 0;
}

/// Where the code lies that belongs to the world: this program's and libstdc++'s. Threads of other libraries,
/// such as Embree's, and their locks are the system's.
struct Code {
    std::array<std::pair<std::uintptr_t, std::uintptr_t>, 2> ranges{};
    std::size_t count = 0;

    Code() {
        ::dl_iterate_phdr(
            [](dl_phdr_info* library, std::size_t, void* to) {
                Code& code = *static_cast<Code*>(to);
                const bool program = library->dlpi_name[0] == '\0' && code.count == 0;
                if (!program && !std::strstr(library->dlpi_name, "libstdc++")) return 0;
                for (int k = 0; k < library->dlpi_phnum; ++k) {
                    const auto& part = library->dlpi_phdr[k];
                    if (part.p_type != PT_LOAD || (part.p_flags & PF_X) == 0) continue;
                    const std::uintptr_t from = library->dlpi_addr + part.p_vaddr;
                    if (code.count < code.ranges.size())
                        code.ranges[code.count++] = {from, from + part.p_memsz};
                }
                return 0;
            },
            this);
    }
};
const Code* code = nullptr;  // made with the world
bool called_inside(const void* caller) {
    if (me < 0) return false;
    const auto at = reinterpret_cast<std::uintptr_t>(caller);
    return std::ranges::any_of(code->ranges,
                               [at](const auto& range) { return at >= range.first && at < range.second; });
}
#define CALLED_INSIDE() called_inside(__builtin_return_address(0))
Process& my_process() {
    return shared->processes[shared->threads[me].process];
}

std::uint64_t draw() {
    std::uint64_t z = shared->random += 0x9e3779b97f4a7c15ull;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return z ^ (z >> 31);
}
int draw(int below) {
    return static_cast<int>(draw() % static_cast<std::uint64_t>(below));
}
bool one_in(int n) {
    return n > 0 && draw(n) == 0;
}

void log(const std::string& line) {
    const std::size_t room = sizeof shared->log - shared->logged, size = std::min(line.size() + 1, room);
    std::memcpy(shared->log + shared->logged, (line + "\n").c_str(), size);
    shared->logged += size;
}

// The system's own functions, beneath those below.

template <class Function>
Function* real(Function*& kept, const char* name, const char* version = nullptr) {
    if (!kept)
        kept = reinterpret_cast<Function*>(version ? ::dlvsym(RTLD_NEXT, name, version)
                                                   : ::dlsym(RTLD_NEXT, name));
    return kept;
}
#define SYSTEM(name) real(system_##name, #name)
#define DECLARE(name) decltype(::name)* system_##name = nullptr
DECLARE(open);
DECLARE(close);
DECLARE(write);
DECLARE(rename);
DECLARE(mkdir);
DECLARE(rmdir);
DECLARE(unlink);
DECLARE(unlinkat);
DECLARE(remove);
DECLARE(ftruncate);
DECLARE(flock);
DECLARE(utimensat);

DECLARE(kill);
DECLARE(clock_gettime);
DECLARE(nanosleep);
DECLARE(sched_yield);
DECLARE(get_nprocs);
DECLARE(pthread_create);
DECLARE(pthread_join);
DECLARE(pthread_mutex_lock);
DECLARE(pthread_mutex_trylock);
DECLARE(pthread_mutex_unlock);
DECLARE(pthread_cond_wait);
DECLARE(pthread_cond_timedwait);
DECLARE(pthread_cond_clockwait);
DECLARE(pthread_cond_signal);
DECLARE(pthread_cond_broadcast);
DECLARE(pthread_once);
#undef DECLARE

pid_t process_number() {
    return static_cast<pid_t>(::syscall(SYS_getpid));
}

// Whose turn it is.

void wait_for_turn(Thread& thread) {
    while (thread.turn.load(std::memory_order_acquire) == 0)
        ::syscall(SYS_futex, &thread.turn, FUTEX_WAIT, 0, nullptr, nullptr, 0);
    thread.turn.store(0, std::memory_order_relaxed);
}

/// A thread by lot that can go on, at the time when one can; −1 where none ever can.
int choose() {
    while (true) {
        std::array<int, most_threads> able{};
        int count = 0;
        std::int64_t next = never;
        for (int k = 0; k < most_threads; ++k) {
            const Thread& thread = shared->threads[k];
            if (!thread.runs) continue;
            if (!thread.waits_for || thread.until <= shared->now) able[static_cast<std::size_t>(count++)] = k;
            next = std::min(next, thread.until);
        }
        if (count > 0) return able[static_cast<std::size_t>(draw(count))];
        if (next == never) return -1;
        shared->now = next;
    }
}

void give_turn(int to) {
    shared->turn = to;
    Thread& thread = shared->threads[to];
    thread.turn.store(1, std::memory_order_release);
    ::syscall(SYS_futex, &thread.turn, FUTEX_WAKE, 1, nullptr, nullptr, 0);
}

[[noreturn]] void stay_stuck() {
    my_process().stuck = true;
    ::_exit(0);
}

/// Lets another thread go on, by lot also this one. Returns when it is this one's turn.
void hand_on() {
    Thread& mine = shared->threads[me];
    const int next = choose();
    if (next < 0) stay_stuck();
    if (next == me) return;
    give_turn(next);
    wait_for_turn(mine);
}

/// To be called where threads can notice each other.
void may_hand_on() {
    shared->now += 100 + draw(2000);
    if (one_in(shared->accidents.switches)) hand_on();
}

/// Whether it was waited for, and not for too long.
bool wait_for(const void* what, std::int64_t until) {
    Thread& mine = shared->threads[me];
    mine.waits_for = what;
    mine.until = until;
    hand_on();
    const bool came = !mine.waits_for;
    mine.waits_for = nullptr;
    mine.until = never;
    return came;
}

void lock(pthread_mutex_t* mutex) {
    for (int k = 0; SYSTEM(pthread_mutex_trylock)(mutex) == EBUSY; ++k) {
        if (k > 1'000'000) stay_stuck();
        shared->now += 1000;
        hand_on();
    }
}

struct Start {
    void* (*work)(void*);
    void* with;
    int thread;
};
void* begin(void* given) {
    const Start start = *static_cast<Start*>(given);
    delete static_cast<Start*>(given);
    Thread& mine = shared->threads[start.thread];
    wait_for_turn(mine);
    me = start.thread;
    void* result = nullptr;
    result = start.work(start.with);
    mine.runs = false;
    const int next = choose();
    if (next < 0) stay_stuck();
    me = -1;  // what it destroys at its end is destroyed outside of the world
    give_turn(next);
    return result;
}

// What goes wrong.

/// Of the files that are open; "" is none of the world's.
std::array<std::string, 1024>& open_names() {
    static auto* const names = new std::array<std::string, 1024>;
    return *names;
}
std::string name_of(int descriptor) {
    const auto at = static_cast<std::size_t>(descriptor);
    return descriptor >= 0 && at < open_names().size() ? open_names()[at] : std::string();
}
/// The path from the world's folder on; "" for one that is not below it.
std::string name_of(const char* path) {
    const std::size_t size = std::strlen(shared->folder);
    return std::strncmp(path, shared->folder, size) == 0 && path[size] == '/' ? path + size + 1 : "";
}

enum class Call { Read, Make, Write, Close, Rename, Mkdir, Remove, Truncate, Lock };
constexpr std::array call_names = {"open to read", "open",   "write",    "close", "rename",
                                   "mkdir",        "remove", "truncate", "lock"};

struct Verdict {
    int error = 0;      // 0: it succeeds
    bool part = false;  // a write of only a part
    bool last = false;  // its process ends after it
};

[[noreturn]] void die() {
    my_process().killed = true;
    ::syscall(SYS_kill, process_number(), SIGKILL);
    while (true) ::pause();
}

int error_of(Call call) {
    const auto of = [](auto... errors) {
        const int all[] = {errors...};
        return all[draw(static_cast<int>(sizeof...(errors)))];
    };
    switch (call) {
        case Call::Read:
            return of(EACCES, EIO, EMFILE);
        case Call::Make:
            return of(ENOSPC, EACCES, EIO, EMFILE, EROFS, EDQUOT);
        case Call::Write:
            return of(ENOSPC, EIO, EDQUOT, EFBIG);
        case Call::Close:
            return of(EIO, ENOSPC, EDQUOT);
        case Call::Rename:
            return of(ENOSPC, EACCES, EIO, EROFS);
        case Call::Mkdir:
            return of(ENOSPC, EACCES, EIO, EROFS);
        case Call::Remove:
            return of(EACCES, EIO, EROFS, EBUSY);
        case Call::Truncate:
            return of(EIO, EROFS);
        case Call::Lock:
            return of(ENOLCK, EINTR, ENOTSUP);
    }
    return EIO;
}

/// Of a call that is about to be made on one of the world's files.
Verdict judge(Call call, const std::string& name) {
    may_hand_on();
    const std::int64_t number = shared->calls++;
    Verdict verdict;
    for (const Fault& fault : shared->accidents.faults) {
        if (number < fault.from || number >= fault.until) continue;
        const bool makes = call == Call::Make || call == Call::Write || call == Call::Mkdir;
        switch (fault.kind) {
            case Fault::Kind::None:
                continue;
            case Fault::Kind::Once:
                verdict.error = error_of(call);
                break;
            case Fault::Kind::Kill:
                if (call != Call::Write || draw(3) == 0) {
                    log(fmt::format("{} {} {}: killed", number, call_names[static_cast<std::size_t>(call)],
                                    name));
                    if (draw(2) == 0) die();
                } else {
                    verdict.part = true;
                }
                verdict.last = true;
                break;
            case Fault::Kind::FullDisk:
                if (!makes) continue;
                if (call == Call::Write && one_in(4))
                    verdict.part = true;
                else
                    verdict.error = ENOSPC;
                break;
            case Fault::Kind::ReadOnly:
                if (call == Call::Read || call == Call::Close || call == Call::Lock) continue;
                if (call == Call::Write || call == Call::Truncate) continue;  // files that are open stay so
                verdict.error = EROFS;
                break;
        }
        break;
    }
    const bool planned = verdict.error != 0 || verdict.part || verdict.last;
    if (!planned && call == Call::Write && one_in(shared->accidents.noise)) {
        if (one_in(2))
            verdict.part = true;
        else
            verdict.error = EINTR;
    }
    if (verdict.error != 0 || verdict.part)
        log(fmt::format("{} {} {}: {}{}", number, call_names[static_cast<std::size_t>(call)], name,
                        verdict.error != 0 ? std::strerror(verdict.error) : "in part",
                        verdict.part && verdict.last ? ", killed" : ""));
    shared->left_behind |= call == Call::Remove && verdict.error != 0;
    return verdict;
}

/// Makes the call unless it is to fail.
template <class Make>
int make(Call call, const std::string& name, const Make& make_it) {
    if (!inside() || name.empty()) return make_it();
    const Verdict verdict = judge(call, name);
    if (verdict.error != 0) {
        errno = verdict.error;
        return -1;
    }
    const int result = make_it();
    if (verdict.last) die();
    return result;
}

std::int64_t ns_of(const timespec& time) {
    return time.tv_sec * 1'000'000'000LL + time.tv_nsec;
}
timespec time_of(std::int64_t ns) {
    return {static_cast<time_t>(ns / 1'000'000'000), static_cast<long>(ns % 1'000'000'000)};
}
bool is_on_the_wall(clockid_t clock) {
    return clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE;
}
bool is_of_the_world(clockid_t clock) {
    return is_on_the_wall(clock) || clock == CLOCK_MONOTONIC || clock == CLOCK_MONOTONIC_RAW ||
           clock == CLOCK_MONOTONIC_COARSE || clock == CLOCK_BOOTTIME;
}
/// What the clock shows [ns].
std::int64_t read_clock(clockid_t clock) {
    shared->now += 50 + draw(1000);
    if (!is_on_the_wall(clock)) return shared->now;
    if (one_in(shared->accidents.jumps)) {
        constexpr std::int64_t year = 31'557'600'000'000'000;
        const std::int64_t far = year * (draw(41) - 20), near = 1'000'000LL * (draw(7'200'001) - 3'600'000);
        const std::int64_t begin = static_cast<std::int64_t>(1e9 * shared->accidents.begin);
        shared->shift =
            std::max<std::int64_t>(begin / 2 - shared->now, one_in(3) ? begin + far : shared->shift + near);
        log(fmt::format("the clock is put to {}", (shared->now + shared->shift) / 1'000'000'000));
    }
    return shared->now + shared->shift;
}

int wait_on(pthread_cond_t* condition, pthread_mutex_t* mutex, std::int64_t until) {
    SYSTEM(pthread_mutex_unlock)(mutex);
    // It may return for no reason.
    const bool came = wait_for(one_in(16) ? nullptr : condition, until);
    lock(mutex);
    return came ? 0 : ETIMEDOUT;
}
int wait_until(pthread_cond_t* condition, pthread_mutex_t* mutex, clockid_t clock, const timespec& time) {
    return wait_on(condition, mutex, ns_of(time) - (is_on_the_wall(clock) ? shared->shift : 0));
}
void wake(pthread_cond_t* condition, bool all) {
    std::vector<int> waiting;
    for (int k = 0; k < most_threads; ++k) {
        const Thread& thread = shared->threads[k];
        if (thread.runs && thread.process == shared->threads[me].process && thread.waits_for == condition)
            waiting.push_back(k);
    }
    if (!all && waiting.size() > 1) waiting = {waiting[static_cast<std::size_t>(draw(int(waiting.size())))]};
    for (const int k : waiting) shared->threads[k].waits_for = nullptr;
}

void play_here(int process, const std::function<void()>& what) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    const rlimit work{most_work, most_work + 1};
    ::setrlimit(RLIMIT_CPU, &work);
    me = process;
    wait_for_turn(shared->threads[me]);
    Process& mine = my_process();
    const auto say = [&](Ended::How how, const char* text) {
        mine.how = how;
        std::snprintf(mine.said, sizeof mine.said, "%s", text);
    };
    try {
        what();
        mine.how = Ended::How::Done;
    } catch (const io::InputError& error) {
        say(Ended::How::Refused, error.what());
    } catch (const std::exception& error) {
        say(Ended::How::Threw, error.what());
    }
    ::_exit(0);
}

void stop_waiting(int) {}

}  // namespace

FaultWorld::FaultWorld(std::filesystem::path folder)
    : folder_(std::move(folder)), next_process_(first_process) {
    if (shared) throw std::logic_error("two worlds at a time");
    static const Code all;
    code = &all;
    void* const at =
        ::mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (at == MAP_FAILED) throw std::bad_alloc();
    shared = new (at) Shared();
    struct sigaction alarm {};
    alarm.sa_handler = stop_waiting;  // without SA_RESTART
    ::sigaction(SIGALRM, &alarm, nullptr);
}

FaultWorld::~FaultWorld() {
    ::munmap(shared, sizeof(Shared));
    shared = nullptr;
}

void FaultWorld::tell_state(std::uint64_t state) {
    if (!inside()) return;
    Process& mine = my_process();
    if (mine.states < most_states) mine.state[mine.states++] = state;
}

Played FaultWorld::play(const Accidents& accidents, const std::vector<std::function<void()>>& what) {
    new (shared) Shared();
    const int count = static_cast<int>(what.size());
    if (count > most_processes) throw std::invalid_argument("too many processes");
    shared->accidents = accidents;
    shared->random = accidents.seed;
    shared->now = 1'000'000'000;
    shared->shift = static_cast<std::int64_t>(1e9 * accidents.begin);
    shared->first_process = next_process_;
    next_process_ += count;
    std::snprintf(shared->folder, sizeof shared->folder, "%s", folder_.c_str());
    std::fflush(nullptr);
    std::vector<pid_t> numbers;
    for (int k = 0; k < count; ++k) {
        shared->threads[k].runs = shared->processes[k].runs = true;
        shared->threads[k].process = k;
    }
    for (int k = 0; k < count; ++k) {
        const pid_t number = ::fork();
        if (number < 0) throw std::runtime_error(fmt::format("fork: {}", std::strerror(errno)));
        if (number == 0) play_here(k, what[static_cast<std::size_t>(k)]);
        numbers.push_back(number);
    }
    Played played;
    played.processes.resize(what.size());
    give_turn(choose());
    bool stopped = false;
    ::alarm(longest_play);
    for (int left = count; left > 0;) {
        int status = 0;
        const pid_t number = ::waitpid(-1, &status, 0);
        if (number < 0 && errno == EINTR) {
            stopped = true;
            for (int k = 0; k < count; ++k)
                if (shared->processes[k].runs) SYSTEM(kill)(numbers[static_cast<std::size_t>(k)], SIGKILL);
            continue;
        }
        const auto at = std::ranges::find(numbers, number);
        if (number < 0 || at == numbers.end()) continue;
        --left;
        const int k = static_cast<int>(at - numbers.begin());
        Process& process = shared->processes[k];
        process.runs = false;
        Ended& ended = played.processes[static_cast<std::size_t>(k)];
        ended.how = process.how;
        ended.said = process.said;
        ended.states.assign(process.state, process.state + process.states);
        if (process.stuck)
            ended.broken = "its threads wait for each other";
        else if (stopped)
            ended.broken = fmt::format("it did not end within {} s", longest_play);
        else if (process.killed)
            ended.how = Ended::How::Killed;
        else if (WIFSIGNALED(status))
            ended.broken = fmt::format("it ended by signal {}", WTERMSIG(status));
        else if (WEXITSTATUS(status) != 0)
            ended.broken = fmt::format("it ended with exit code {}", WEXITSTATUS(status));
        // Only now its locks are gone: another process goes on.
        for (Thread& thread : shared->threads)
            if (thread.process == k) thread.runs = false;
        if (left > 0 && !stopped && shared->threads[shared->turn].process == k) give_turn(choose());
    }
    ::alarm(0);
    played.calls = shared->calls;
    played.log.assign(shared->log, shared->logged);
    played.left_behind = shared->left_behind;
    return played;
}

}  // namespace fuzz

// In place of the system's. Where the world is not, they are those.

using namespace fuzz;

extern "C" {

int open(const char* path, int flags, ...) {
    va_list list;
    va_start(list, flags);
    const mode_t mode = (flags & (O_CREAT | __O_TMPFILE)) != 0 ? va_arg(list, mode_t) : 0;
    va_end(list);
    const auto open_it = [&] { return SYSTEM(open)(path, flags, mode); };
    if (!inside()) return open_it();
    const std::string name = name_of(path);
    const int descriptor = make((flags & (O_WRONLY | O_RDWR)) != 0 ? Call::Make : Call::Read, name, open_it);
    if (descriptor >= 0 && descriptor < 1024) open_names()[static_cast<std::size_t>(descriptor)] = name;
    return descriptor;
}
int open64(const char* path, int flags, ...) {
    va_list list;
    va_start(list, flags);
    const mode_t mode = (flags & (O_CREAT | __O_TMPFILE)) != 0 ? va_arg(list, mode_t) : 0;
    va_end(list);
    return open(path, flags, mode);
}
int close(int descriptor) {
    if (!inside()) return SYSTEM(close)(descriptor);
    const std::string name = name_of(descriptor);
    if (name.empty()) return SYSTEM(close)(descriptor);
    open_names()[static_cast<std::size_t>(descriptor)].clear();
    const Verdict verdict = judge(Call::Close, name);
    const int result = SYSTEM(close)(descriptor);  // a close that fails closes all the same
    if (verdict.last) die();
    if (verdict.error == 0) return result;
    errno = verdict.error;
    return -1;
}
ssize_t write(int descriptor, const void* bytes, std::size_t count) {
    const std::string name = inside() ? name_of(descriptor) : "";
    if (name.empty()) return SYSTEM(write)(descriptor, bytes, count);
    const Verdict verdict = judge(Call::Write, name);
    if (verdict.error != 0) {
        errno = verdict.error;
        return -1;
    }
    if (verdict.part && count > 1) count = 1 + draw() % (count - 1);
    const ssize_t result = SYSTEM(write)(descriptor, bytes, count);
    if (verdict.last) die();
    return result;
}
int rename(const char* from, const char* to) noexcept {
    return make(Call::Rename, inside() ? name_of(to) : "", [&] { return SYSTEM(rename)(from, to); });
}
int mkdir(const char* path, mode_t mode) noexcept {
    return make(Call::Mkdir, inside() ? name_of(path) : "", [&] { return SYSTEM(mkdir)(path, mode); });
}
int rmdir(const char* path) noexcept {
    return make(Call::Remove, inside() ? name_of(path) : "", [&] { return SYSTEM(rmdir)(path); });
}
int unlink(const char* path) noexcept {
    return make(Call::Remove, inside() ? name_of(path) : "", [&] { return SYSTEM(unlink)(path); });
}
int unlinkat(int folder, const char* path, int flags) noexcept {
    return make(Call::Remove, inside() ? path : "", [&] { return SYSTEM(unlinkat)(folder, path, flags); });
}
int remove(const char* path) noexcept {
    return make(Call::Remove, inside() ? name_of(path) : "", [&] { return SYSTEM(remove)(path); });
}
int ftruncate(int descriptor, off_t size) noexcept {
    return make(Call::Truncate, inside() ? name_of(descriptor) : "",
                [&] { return SYSTEM(ftruncate)(descriptor, size); });
}
int flock(int descriptor, int how) noexcept {
    return make(Call::Lock, inside() ? name_of(descriptor) : "",
                [&] { return SYSTEM(flock)(descriptor, how); });
}
int utimensat(int folder, const char* path, const timespec* times, int flags) noexcept {
    if (!inside() || times) return SYSTEM(utimensat)(folder, path, times, flags);
    const timespec now = time_of(read_clock(CLOCK_REALTIME)), both[2] = {now, now};
    return SYSTEM(utimensat)(folder, path, both, flags);
}

pid_t getpid() noexcept {
    return inside() ? shared->first_process + shared->threads[me].process : process_number();
}
int kill(pid_t process, int signal) noexcept {
    if (!inside() || process < first_process || signal != 0) return SYSTEM(kill)(process, signal);
    const int k = process - shared->first_process;
    if (k >= 0 && k < most_processes && shared->processes[k].runs) return 0;
    errno = ESRCH;
    return -1;
}

int clock_gettime(clockid_t clock, timespec* time) noexcept {
    if (!inside() || !is_of_the_world(clock)) return SYSTEM(clock_gettime)(clock, time);
    *time = time_of(read_clock(clock));
    return 0;
}
int nanosleep(const timespec* time, timespec* rest) {
    if (!CALLED_INSIDE()) return SYSTEM(nanosleep)(time, rest);
    wait_for(&shared->threads[me], shared->now + ns_of(*time));
    return 0;
}
int clock_nanosleep(clockid_t clock, int flags, const timespec* time, timespec*) {
    if (!CALLED_INSIDE())
        return static_cast<int>(::syscall(SYS_clock_nanosleep, clock, flags, time, nullptr)) == 0 ? 0 : errno;
    const bool at = (flags & TIMER_ABSTIME) != 0;
    wait_for(&shared->threads[me],
             at ? ns_of(*time) - (is_on_the_wall(clock) ? shared->shift : 0) : shared->now + ns_of(*time));
    return 0;
}
int sched_yield() noexcept {
    if (!CALLED_INSIDE()) return SYSTEM(sched_yield)();
    hand_on();
    return 0;
}
int get_nprocs() noexcept {
    return CALLED_INSIDE() ? shared->accidents.processors : SYSTEM(get_nprocs)();
}

int pthread_create(pthread_t* handle, const pthread_attr_t* attributes, void* (*work)(void*),
                   void* with) noexcept {
    if (!CALLED_INSIDE()) return SYSTEM(pthread_create)(handle, attributes, work, with);
    int k = 0;
    // A place is not used again before its thread was joined.
    while (k < most_threads && (shared->threads[k].runs || shared->threads[k].handle != 0)) ++k;
    if (k == most_threads) return EAGAIN;
    Thread& thread = shared->threads[k];
    const int result = SYSTEM(pthread_create)(handle, attributes, begin, new Start{work, with, k});
    if (result != 0) return result;
    thread.process = shared->threads[me].process;
    thread.waits_for = nullptr;
    thread.until = never;
    thread.handle = *handle;
    thread.runs = true;
    may_hand_on();
    return 0;
}
int pthread_join(pthread_t handle, void** result) {
    if (!CALLED_INSIDE()) return SYSTEM(pthread_join)(handle, result);
    for (Thread& thread : shared->threads) {
        if (thread.handle != handle || thread.process != shared->threads[me].process) continue;
        for (int k = 0; thread.runs; ++k) {
            if (k > 1'000'000) stay_stuck();
            shared->now += 1000;
            hand_on();
        }
        thread.handle = 0;
        break;
    }
    return SYSTEM(pthread_join)(handle, result);
}
int pthread_mutex_lock(pthread_mutex_t* mutex) noexcept {
    if (!CALLED_INSIDE()) return SYSTEM(pthread_mutex_lock)(mutex);
    may_hand_on();
    lock(mutex);
    return 0;
}
int pthread_mutex_trylock(pthread_mutex_t* mutex) noexcept {
    if (CALLED_INSIDE()) may_hand_on();
    return SYSTEM(pthread_mutex_trylock)(mutex);
}
int pthread_mutex_unlock(pthread_mutex_t* mutex) noexcept {
    const int result = SYSTEM(pthread_mutex_unlock)(mutex);
    if (CALLED_INSIDE()) may_hand_on();
    return result;
}
int pthread_cond_wait(pthread_cond_t* condition, pthread_mutex_t* mutex) {
    if (CALLED_INSIDE()) {
        wait_on(condition, mutex, never);
        return 0;
    }
    return real(system_pthread_cond_wait, "pthread_cond_wait", "GLIBC_2.3.2")(condition, mutex);
}
int pthread_cond_timedwait(pthread_cond_t* condition, pthread_mutex_t* mutex, const timespec* time) {
    if (CALLED_INSIDE()) return wait_until(condition, mutex, CLOCK_REALTIME, *time);
    return real(system_pthread_cond_timedwait, "pthread_cond_timedwait", "GLIBC_2.3.2")(condition, mutex,
                                                                                        time);
}
int pthread_cond_clockwait(pthread_cond_t* condition, pthread_mutex_t* mutex, clockid_t clock,
                           const timespec* time) {
    if (CALLED_INSIDE()) return wait_until(condition, mutex, clock, *time);
    return SYSTEM(pthread_cond_clockwait)(condition, mutex, clock, time);
}
int pthread_cond_signal(pthread_cond_t* condition) noexcept {
    if (!CALLED_INSIDE())
        return real(system_pthread_cond_signal, "pthread_cond_signal", "GLIBC_2.3.2")(condition);
    wake(condition, false);
    may_hand_on();
    return 0;
}
int pthread_cond_broadcast(pthread_cond_t* condition) noexcept {
    if (!CALLED_INSIDE())
        return real(system_pthread_cond_broadcast, "pthread_cond_broadcast", "GLIBC_2.3.2")(condition);
    wake(condition, true);
    may_hand_on();
    return 0;
}

// A thread may hand on within what is done once, so that others may not sleep in the system for its end.
int pthread_once(pthread_once_t* once, void (*work)()) {
    if (!CALLED_INSIDE()) return SYSTEM(pthread_once)(once, work);
    constexpr int done = 2;  // glibc's
    while (true) {
        if (*once == done) return 0;
        if (*once == 0) break;
        hand_on();
    }
    *once = 1;
    try {
        work();
    } catch (...) {
        *once = 0;
        throw;
    }
    *once = done;
    return 0;
}
}  // extern "C"

namespace __cxxabiv1 {
/// Of an object that is made once: its first byte says that it is, the second that it is being made.
extern "C" int __cxa_guard_acquire(std::int64_t* guard) noexcept {
    auto* const bytes = reinterpret_cast<volatile char*>(guard);
    while (true) {
        if (__atomic_load_n(&bytes[0], __ATOMIC_ACQUIRE) != 0) return 0;
        if (char none = 0;
            __atomic_compare_exchange_n(&bytes[1], &none, 1, false, __ATOMIC_ACQ_REL, __ATOMIC_ACQUIRE))
            return 1;
        if (inside())
            hand_on();
        else
            ::syscall(SYS_sched_yield);
    }
}
extern "C" void __cxa_guard_release(std::int64_t* guard) noexcept {
    auto* const bytes = reinterpret_cast<volatile char*>(guard);
    __atomic_store_n(&bytes[0], 1, __ATOMIC_RELEASE);
    __atomic_store_n(&bytes[1], 0, __ATOMIC_RELEASE);
}
extern "C" void __cxa_guard_abort(std::int64_t* guard) noexcept {
    __atomic_store_n(reinterpret_cast<volatile char*>(guard) + 1, 0, __ATOMIC_RELEASE);
}
}  // namespace __cxxabiv1
