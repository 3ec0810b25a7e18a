#include "engine/io/wall.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <exception>
#include <fcntl.h>
#include <fmt/format.h>
#include <fstream>
#include <mutex>
#include <new>
#include <optional>
#include <seccomp.h>
#include <stdexcept>
#include <string>
#include <string_view>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>
#include <utility>
#include <vector>

#include "engine/io/error.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define SELDINGER_SANITIZED 1
#endif

#ifndef SYS_close_range
#define SYS_close_range 436  // on all processors; headers of glibc 2.31 do not know it
#endif

namespace io {
namespace {

namespace fs = std::filesystem;

std::shared_mutex& making_children() {
    static std::shared_mutex mutex;
    return mutex;
}
std::atomic<int> without{0};

/// Kinds of messages, before their length and their bytes.
enum class Kind : char { Progress, Refusal, Memory, Defect, Done };

bool write_all(int descriptor, const void* from, std::size_t bytes) {
    for (const auto* at = static_cast<const char*>(from); bytes > 0;) {
        const ssize_t written = ::write(descriptor, at, bytes);
        if (written < 0 && errno == EINTR) continue;
        if (written <= 0) return false;
        at += written, bytes -= static_cast<std::size_t>(written);
    }
    return true;
}
bool read_all(int descriptor, void* to, std::size_t bytes) {
    for (auto* at = static_cast<char*>(to); bytes > 0;) {
        const ssize_t read = ::read(descriptor, at, bytes);
        if (read < 0 && errno == EINTR) continue;
        if (read <= 0) return false;
        at += read, bytes -= static_cast<std::size_t>(read);
    }
    return true;
}

/// The child's side of the pipe, and its result.
constexpr int words = 3, result = 4;

void say(Kind kind, std::string_view text) {
    const auto size = static_cast<std::uint32_t>(text.size());
    std::string message(1 + sizeof size, static_cast<char>(kind));
    std::memcpy(message.data() + 1, &size, sizeof size);
    message += text;
    if (!write_all(words, message.data(), message.size())) ::_exit(1);  // nobody listens any more
}

/// Hands the fields to the parent without a copy of all of them.
class Handing final : public geometry::StateStream {
public:
    void finish() { flush(); }

private:
    void raw(void* data, std::size_t bytes) override {
        if (bytes == 0) return;  // of an empty list, which may lie nowhere
        if (used_ + bytes > buffer_.size()) flush();
        if (bytes > buffer_.size()) return put(data, bytes);
        std::memcpy(buffer_.data() + used_, data, bytes);
        used_ += bytes;
    }
    void flush() { put(buffer_.data(), std::exchange(used_, 0)); }
    static void put(const void* data, std::size_t bytes) {
        if (!write_all(result, data, bytes)) throw std::bad_alloc();
    }
    std::vector<char> buffer_ = std::vector<char>(1 << 16);
    std::size_t used_ = 0;
};

void limit(int resource, rlim_t soft, rlim_t hard) {
    rlimit now{};
    if (::getrlimit(resource, &now) != 0) return;
    now.rlim_max = std::min(now.rlim_max, hard);
    now.rlim_cur = std::min({now.rlim_cur, soft, now.rlim_max});
    ::setrlimit(resource, &now);
}

/// Address space that this process has [bytes]; none where it is not known.
std::optional<std::uint64_t> address_space() {
    std::ifstream file("/proc/self/statm");
    std::uint64_t pages = 0;
    if (!(file >> pages)) return std::nullopt;
    return pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

/// All that reading a file, memory and threads of one's own need; else EPERM. Not what makes or changes a
/// file, a process or a connection.
void limit_system_calls() {
    const scmp_filter_ctx filter = ::seccomp_init(SCMP_ACT_ERRNO(EPERM));
    if (filter == nullptr) return;
    for (const char* name : {"read",
                             "pread64",
                             "readv",
                             "lseek",
                             "_llseek",
                             "fstat",
                             "fstat64",
                             "newfstatat",
                             "fstatat64",
                             "statx",
                             "stat",
                             "lstat",
                             "access",
                             "faccessat",
                             "faccessat2",
                             "readlink",
                             "readlinkat",
                             "getdents64",
                             "getcwd",
                             "close",
                             "write",
                             "writev",
                             "ftruncate",
                             "mmap",
                             "mmap2",
                             "munmap",
                             "mremap",
                             "mprotect",
                             "madvise",
                             "brk",
                             "futex",
                             "futex_time64",
                             "set_robust_list",
                             "rseq",
                             "sched_yield",
                             "gettid",
                             "getpid",
                             "getuid",
                             "geteuid",
                             "getgid",
                             "getegid",
                             "rt_sigprocmask",
                             "rt_sigaction",
                             "rt_sigreturn",
                             "sigaltstack",
                             "clock_gettime",
                             "gettimeofday",
                             "clock_nanosleep",
                             "nanosleep",
                             "getrandom",
                             "sysinfo",
                             "uname",
                             "getrusage",
                             "getrlimit",
                             "exit",
                             "exit_group",
                             "restart_syscall",
                             "sched_getaffinity",
                             "fadvise64"}) {
        const int call = ::seccomp_syscall_resolve_name(name);
        if (call != __NR_SCMP_ERROR) ::seccomp_rule_add(filter, SCMP_ACT_ALLOW, call, 0);
    }
    // Files are opened to be read; threads are made, and no processes. What a new thread is to be lies in
    // memory for clone3, where it cannot be seen: glibc takes clone then.
    constexpr scmp_datum_t writes = O_WRONLY | O_RDWR | O_CREAT | O_TRUNC | O_APPEND;
    ::seccomp_rule_add(filter, SCMP_ACT_ALLOW, SCMP_SYS(openat), 1, SCMP_A2(SCMP_CMP_MASKED_EQ, writes, 0));
    ::seccomp_rule_add(filter, SCMP_ACT_ALLOW, SCMP_SYS(open), 1, SCMP_A1(SCMP_CMP_MASKED_EQ, writes, 0));
    constexpr scmp_datum_t thread = CLONE_THREAD;
    ::seccomp_rule_add(filter, SCMP_ACT_ALLOW, SCMP_SYS(clone), 1,
                       SCMP_A0(SCMP_CMP_MASKED_EQ, thread, thread));
    ::seccomp_rule_add(filter, SCMP_ACT_ERRNO(ENOSYS), SCMP_SYS(clone3), 0);
    // abort() signals its own process.
    ::seccomp_rule_add(filter, SCMP_ACT_ALLOW, SCMP_SYS(tgkill), 1,
                       SCMP_A0(SCMP_CMP_EQ, static_cast<scmp_datum_t>(::getpid())));
    // Not the owner of a descriptor, who is sent signals.
    for (const int asked : {F_GETFD, F_SETFD, F_GETFL})
        ::seccomp_rule_add(filter, SCMP_ACT_ALLOW, SCMP_SYS(fcntl), 1,
                           SCMP_A1(SCMP_CMP_EQ, static_cast<scmp_datum_t>(asked)));
    // Limits are read, by whoever asks for a thread's stack.
    ::seccomp_rule_add(filter, SCMP_ACT_ALLOW, SCMP_SYS(prlimit64), 1, SCMP_A2(SCMP_CMP_EQ, 0));
#ifdef SELDINGER_SANITIZED
    for (const char* name : {"prctl", "ptrace", "ioctl", "process_vm_readv", "pipe2", "wait4"})
        ::seccomp_rule_add(filter, SCMP_ACT_ALLOW, ::seccomp_syscall_resolve_name(name), 0);
#endif
    ::seccomp_load(filter);
    ::seccomp_release(filter);
}

/// What the child leaves at its entrance.
void leave_all(int to_parent, int memory, pid_t parent, const WallLimits& limits, std::uint64_t space) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(1);
    // The terminal's signals are heard by the parent, which ends this process.
    for (int signal = 1; signal < NSIG; ++signal) {
        struct sigaction as_usual {};
        struct sigaction before {};
        if (::sigaction(signal, nullptr, &before) != 0 || before.sa_handler == SIG_IGN) continue;
#ifdef SELDINGER_SANITIZED
        if (signal == SIGSEGV || signal == SIGBUS || signal == SIGFPE) continue;
#endif
        as_usual.sa_handler = signal == SIGINT ? SIG_IGN : SIG_DFL;
        ::sigaction(signal, &as_usual, nullptr);
    }
    sigset_t none;
    ::sigemptyset(&none);
    ::sigprocmask(SIG_SETMASK, &none, nullptr);
    ::signal(SIGPIPE, SIG_IGN);
    // Descriptors: 3 and 4 may be among those that are to be moved.
    const int first = ::fcntl(to_parent, F_DUPFD, 10), second = ::fcntl(memory, F_DUPFD, 10);
    if (first < 0 || second < 0 || ::dup2(first, words) < 0 || ::dup2(second, result) < 0) ::_exit(1);
    const int nowhere = ::open("/dev/null", O_RDWR);
#ifdef SELDINGER_SANITIZED
    ::dup2(nowhere, STDIN_FILENO);
#else
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) ::dup2(nowhere, stream);
#endif
    if (::syscall(SYS_close_range, 5u, ~0u, 0u) != 0) {  // before Linux 5.9
        rlimit most{};
        ::getrlimit(RLIMIT_NOFILE, &most);
        for (int other = 5; other < static_cast<int>(std::min<rlim_t>(most.rlim_cur, 65536)); ++other)
            ::close(other);
    }
    limit(RLIMIT_CORE, 0, 0);  // a patient's data
    ::prctl(PR_SET_DUMPABLE, 0);
    const auto seconds = static_cast<rlim_t>(std::max(1.0, limits.processor_time));
    limit(RLIMIT_CPU, seconds, seconds + 1);
    limit(RLIMIT_STACK, limits.stack, limits.stack);
#ifndef SELDINGER_SANITIZED
    if (space > 0) limit(RLIMIT_AS, space, space);
#endif
    static_cast<void>(space);
    ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
    limit_system_calls();
}

[[noreturn]] void child(const std::function<void(geometry::StateStream&, const Progress&)>& work) {
    ++without;  // readers within readers are behind this wall already
    try {
        Handing handing;
        work(handing, [](double part, const char* what) {
            std::string text(sizeof part, '\0');
            std::memcpy(text.data(), &part, sizeof part);
            say(Kind::Progress, text + what);
        });
        handing.finish();
        say(Kind::Done, {});
        ::_exit(0);
    } catch (const InputError& error) {
        say(Kind::Refusal, error.what());
    } catch (const std::bad_alloc&) {
        say(Kind::Memory, {});
    } catch (const std::exception& error) {
        say(Kind::Defect, error.what());
    }
    ::_exit(1);
}

/// Ends a child and takes it away, however its user leaves.
class Child {
public:
    explicit Child(pid_t process) : process_(process) {}
    ~Child() {
        if (process_ <= 0) return;
        ::kill(process_, SIGKILL);
        ended();
    }
    Child(const Child&) = delete;
    Child& operator=(const Child&) = delete;

    /// How it ended; none where the host program has taken that itself.
    std::optional<int> ended() {
        int status = 0;
        pid_t found = 0;
        do found = ::waitpid(process_, &status, 0);
        while (found < 0 && errno == EINTR);
        process_ = 0;
        return found > 0 ? std::optional(status) : std::nullopt;
    }

private:
    pid_t process_;
};

struct Descriptor {
    int number = -1;
    ~Descriptor() { close(); }
    void close() {
        if (number >= 0) ::close(std::exchange(number, -1));
    }
    explicit Descriptor(int given) : number(given) {}
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
};

[[noreturn]] void refuse_ended(const fs::path& file, std::optional<int> status, const WallLimits& limits) {
    const int signal = status && WIFSIGNALED(*status) ? WTERMSIG(*status) : 0;
    if (signal == SIGXCPU || signal == SIGKILL)
        throw InputError(
            "{}: reading it took more than {:g} s of processor time, or was killed; expected a file "
            "that is read sooner",
            file.string(), limits.processor_time);
    const std::string how = signal != 0 ? fmt::format("by signal {} ({})", signal, ::strsignal(signal))
                                        : std::string("without a result");
    throw InputError(
        "{}: the process that read it ended {}, as a damaged or hostile file can make it; expected a "
        "file that other programs read",
        file.string(), how);
}

}  // namespace

NoChildMeanwhile::NoChildMeanwhile() {
    if (has_wall()) lock_ = std::shared_lock(making_children());
}

WithoutWall::WithoutWall() {
    ++without;
}
WithoutWall::~WithoutWall() {
    --without;
}
bool has_wall() {
    return without == 0;
}

std::shared_ptr<const geometry::MappedFile> behind_wall(
    const fs::path& file, const Progress& progress,
    const std::function<void(geometry::StateStream&, const Progress&)>& work, const WallLimits& limits) {
    const auto cannot = [&](int error) {
        throw InputError("{}: no process could be made to read it ({}); expected room for one more",
                         file.string(), std::strerror(error));
    };
    std::array<int, 2> pipe{};
    if (::pipe2(pipe.data(), O_CLOEXEC) != 0) cannot(errno);
    Descriptor from_child(pipe[0]), to_parent(pipe[1]);
    const Descriptor memory(::memfd_create("seldinger-read", MFD_CLOEXEC));
    if (memory.number < 0) cannot(errno);
    std::error_code unknown;
    const std::uintmax_t size = fs::is_regular_file(file, unknown) ? fs::file_size(file, unknown) : 0;
    const auto has = address_space();
    const std::uint64_t space = has ? *has + limits.memory + (unknown ? 0 : size) : 0;
    const pid_t parent = ::getpid();
    pid_t process = -1;
    {
        const std::unique_lock alone(making_children());
        process = ::fork();
        if (process == 0) {
            leave_all(to_parent.number, memory.number, parent, limits, space);
            child(work);
        }
    }
    if (process < 0) cannot(errno);
    Child reader(process);
    to_parent.close();
    for (;;) {
        Kind kind{};
        std::uint32_t bytes = 0;
        if (!read_all(from_child.number, &kind, sizeof kind) ||
            !read_all(from_child.number, &bytes, sizeof bytes) || bytes > 1'000'000)
            break;
        std::string text(bytes, '\0');
        if (!read_all(from_child.number, text.data(), bytes)) break;
        if (kind == Kind::Done) {
            reader.ended();
            return geometry::MappedFile::of_descriptor(memory.number);
        }
        if (kind == Kind::Refusal) throw InputError(text);
        if (kind == Kind::Memory) throw std::bad_alloc();
        if (kind == Kind::Defect) throw std::logic_error(printable(text));
        double part = 0;
        if (kind != Kind::Progress || bytes < sizeof part) break;
        std::memcpy(&part, text.data(), sizeof part);
        if (progress) progress(part, text.c_str() + sizeof part);
    }
    from_child.close();
    refuse_ended(file, reader.ended(), limits);
}

}  // namespace io
