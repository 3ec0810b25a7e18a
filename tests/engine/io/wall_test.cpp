#include "engine/io/wall.h"

#include <arpa/inet.h>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <fcntl.h>
#include <fmt/format.h>
#include <fstream>
#include <new>
#include <numeric>
#include <stdexcept>
#include <string>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>
#include <vector>

#include "engine/io/error.h"
#include "engine/io/files.h"
#include "physics/geometry/parallel.h"
#include "tests/engine/fixtures.h"

namespace io {
namespace {

#if defined(__SANITIZE_ADDRESS__)
constexpr bool sanitized = true;
#else
constexpr bool sanitized = false;
#endif

const auto field = [](geometry::StateStream& s, auto& value) { s(value); };

/// What is said of a reader in a child.
template <class Read>
std::string said(const Read& read, const WallLimits& limits = {}) {
    return test::refusal([&] {
        read_behind_wall(
            "a.stl", {},
            [&](const Progress&) {
                read();
                return 0;
            },
            field, limits);
    });
}

/// The number of an error that a system call had in a child; 0 without one.
template <class Call>
int error_of(const Call& call) {
    return read_behind_wall(
        "a.stl", {}, [&](const Progress&) { return call() < 0 ? errno : 0; }, field);
}

volatile int sink = 0;
int nested(int depth) {
    volatile char room[4096];
    room[0] = static_cast<char>(depth);
    sink = room[0];
    return depth == 0 ? 0 : nested(depth - 1) + room[0];
}

}  // namespace

using Wall = test::InFolder;

TEST_F(Wall, HandsOverWhatWasReadToTheLastBit) {
    std::vector<double> many(300'000);
    std::iota(many.begin(), many.end(), 0.1);
    struct Read {
        std::vector<double> numbers;
        std::vector<std::string> words;
        bool yes = false;
    };
    const Read read = read_behind_wall(
        "a.stl", {},
        [&](const Progress&) {
            return Read{many, {"one", "", std::string(100'000, 'x')}, true};
        },
        [](geometry::StateStream& s, Read& all) { s(all.numbers, all.words, all.yes); });
    EXPECT_EQ(read.numbers, many);
    EXPECT_EQ(read.words, (std::vector<std::string>{"one", "", std::string(100'000, 'x')}));
    EXPECT_TRUE(read.yes);
}

TEST_F(Wall, RefusalsAndWantOfMemoryArriveAsTheyWereThrown) {
    EXPECT_EQ(said([] { throw InputError("a.stl:3: 'x' was found; expected a number"); }),
              "a.stl:3: 'x' was found; expected a number");
    const auto throws = [](const auto& read) {
        read_behind_wall(
            "a.stl", {}, [&](const Progress&) { return read(), 0; }, field);
    };
    EXPECT_THROW(throws([] { throw std::bad_alloc(); }), std::bad_alloc);
    EXPECT_THROW(throws([] { throw std::out_of_range("a defect"); }), std::logic_error);
}

TEST_F(Wall, ACrashOfTheReaderIsARefusalThatNamesTheFile) {
    if (sanitized) GTEST_SKIP() << "a crash is reported by the sanitizer";
    const auto expect_end = [](const std::string& text, const std::string& how) {
        EXPECT_TRUE(text.starts_with("a.stl: the process that read it ended " + how)) << text;
    };
    expect_end(said([] { ::raise(SIGSEGV); }), "by signal 11 (Segmentation fault)");
    expect_end(said([] { std::abort(); }), "by signal 6 (Aborted)");
    expect_end(said([] { nested(100'000); }), "by signal 11 (Segmentation fault)");  // 400 MB of stack
    expect_end(said([] { ::_exit(0); }), "without a result");
}

TEST_F(Wall, AReaderWithoutEndMeetsItsLimitOfTime) {
    WallLimits limits;
    limits.processor_time = 1;
    EXPECT_EQ(
        said(
            [] {
                for (;;) sink = sink ^ 1;
            },
            limits),
        "a.stl: reading it took more than 1 s of processor time, or was killed; expected a file that is "
        "read sooner");
}

TEST_F(Wall, AReaderHasNoMoreMemoryThanItsLimit) {
    if (sanitized) GTEST_SKIP() << "sanitizers need address space without a limit";
    WallLimits limits;
    limits.memory = 200'000'000;
    const auto take = [&](std::size_t bytes) {
        return read_behind_wall(
            "a.stl", {},
            [&](const Progress&) {
                const std::vector<char> room(bytes, 'x');
                return static_cast<double>(room.size());
            },
            field, limits);
    };
    EXPECT_EQ(take(100'000'000), 1e8);
    EXPECT_THROW(take(300'000'000), std::bad_alloc);
}

TEST_F(Wall, AReaderMakesAndChangesNoFileNoProcessAndNoConnection) {
    test::write(folder / "mine", "text");
    const std::string mine = (folder / "mine").string(), other = (folder / "other").string();
    EXPECT_EQ(error_of([&] { return ::open(mine.c_str(), O_RDONLY); }), 0);
    for (const int how : {O_WRONLY, O_RDWR, O_RDONLY | O_TRUNC, O_RDONLY | O_CREAT, O_WRONLY | O_APPEND})
        EXPECT_EQ(error_of([&] { return ::open(mine.c_str(), how, 0600); }), EPERM) << how;
    EXPECT_EQ(error_of([&] { return ::unlink(mine.c_str()); }), EPERM);
    EXPECT_EQ(error_of([&] { return ::rename(mine.c_str(), other.c_str()); }), EPERM);
    EXPECT_EQ(error_of([&] { return ::mkdir(other.c_str(), 0700); }), EPERM);
    EXPECT_EQ(error_of([&] { return ::symlink(mine.c_str(), other.c_str()); }), EPERM);
    EXPECT_EQ(error_of([&] { return ::truncate(mine.c_str(), 0); }), EPERM);
    EXPECT_EQ(error_of([&] { return ::chmod(mine.c_str(), 0); }), EPERM);
    EXPECT_EQ(error_of([&] { return ::mkfifo(other.c_str(), 0600); }), EPERM);
    EXPECT_EQ(error_of([] { return ::socket(AF_INET, SOCK_STREAM, 0); }), EPERM);
    EXPECT_EQ(error_of([] { return ::socket(AF_UNIX, SOCK_STREAM, 0); }), EPERM);
    EXPECT_EQ(error_of([] { return ::kill(::getppid(), SIGTERM); }), EPERM);
    EXPECT_EQ(error_of([] { return ::syscall(SYS_tgkill, ::getppid(), ::getppid(), SIGTERM); }), EPERM);
    EXPECT_EQ(error_of([] { return ::fcntl(3, F_SETOWN, ::getppid()); }), EPERM);
    EXPECT_EQ(error_of([] { return ::execl("/bin/true", "true", nullptr); }), EPERM);
    if (!sanitized) {
        EXPECT_EQ(error_of([] { return ::fork(); }), EPERM);
    }
    EXPECT_EQ(test::read(folder / "mine"), "text");
    EXPECT_FALSE(std::filesystem::exists(folder / "other"));
}

TEST_F(Wall, AReaderHasNoFileOfThisProcess) {
    GrowingFile recording(folder / "recording.gw");
    WholeFile part(folder / "whole");
    part.append("whole");
    const int open = read_behind_wall(
        "a.stl", {},
        [](const Progress&) {
            int found = 0;
            for (int other = 5; other < 1000; ++other) found += ::fcntl(other, F_GETFD) >= 0;
            return found;
        },
        field);
    EXPECT_EQ(open, 0);
    recording.append("a line\n");
    part.close();
    part.put();
    EXPECT_EQ(test::read(folder / "recording.gw"), "a line\n");
    EXPECT_EQ(test::read(folder / "whole"), "whole");
}

TEST_F(Wall, ReadersMayHaveThreads) {
    const double sum = read_behind_wall(
        "a.stl", {},
        [](const Progress&) {
            std::vector<double> squares(10'000);
            geometry::parallel_for(10'000, 4, [&](int i) { squares[static_cast<std::size_t>(i)] = i; });
            return std::accumulate(squares.begin(), squares.end(), 0.0);
        },
        field);
    EXPECT_EQ(sum, 49'995'000.0);
}

TEST_F(Wall, ProgressIsToldHereAndWhoThrowsInItEndsTheReader) {
    std::vector<std::pair<double, std::string>> told;
    const auto read = [&](const Progress& progress, const auto& after) {
        return read_behind_wall(
            "a.stl", progress,
            [&](const Progress& told) {
                told(0.25, "reading the CT");
                told(0.5, "");
                after();
                return 7;
            },
            field);
    };
    EXPECT_EQ(read([&](double part, const char* what) { told.emplace_back(part, what); }, [] {}), 7);
    EXPECT_EQ(told, (std::vector<std::pair<double, std::string>>{{0.25, "reading the CT"}, {0.5, ""}}));
    const auto stops = [](double part, const char*) {
        if (part == 0.5) throw std::runtime_error("stopped");
    };
    EXPECT_THROW(read(stops,
                      [] {
                          ::pause();
                          ::sleep(600);
                      }),
                 std::runtime_error);
    EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1) << "a child is left";
}

TEST_F(Wall, AReaderWithinAReaderNeedsNoOtherChild) {
    const auto process = [] {
        const NoChildMeanwhile here;
        return read_behind_wall(
            "b.stl", {}, [](const Progress&) { return ::getpid(); }, field);
    };
    const auto both = read_behind_wall(
        "a.stl", {},
        [&](const Progress&) {
            return std::vector<int>{::getpid(), process()};
        },
        field);
    EXPECT_EQ(both[0], both[1]);
    EXPECT_NE(both[0], ::getpid());
}

TEST_F(Wall, ManyThreadsReadAtOnce) {
    if (sanitized) GTEST_SKIP() << "another thread may hold the sanitizer's allocator while a child is made";
    std::atomic<int> wrong{0};
    {
        std::vector<std::jthread> threads;
        for (int t = 0; t < 8; ++t)
            threads.emplace_back([&wrong, t] {
                for (int i = 0; i < 25; ++i) {
                    const std::vector<int> numbers(1000, 100 * t + i);
                    if (i % 5 == 0) {
                        wrong += said([] { throw InputError("a.stl: no"); }) != "a.stl: no";
                    } else {
                        wrong += read_behind_wall(
                                     "a.stl", {}, [&](const Progress&) { return numbers; }, field) != numbers;
                    }
                }
            });
    }
    EXPECT_EQ(wrong, 0);
}

TEST_F(Wall, WorksWhereTheProgramLetsNobodyWaitForChildren) {
    const auto before = std::signal(SIGCHLD, SIG_IGN);
    EXPECT_EQ(read_behind_wall(
                  "a.stl", {}, [](const Progress&) { return 7; }, field),
              7);
    std::signal(SIGCHLD, before);
}

}  // namespace io
