#pragma once
/// The built program, run as a user runs it.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <string>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>
#include <vector>

#include "tests/engine/fixtures.h"

namespace test {

inline const std::string good_script = asset("scripts/s_bend.gw");

struct Outcome {
    int code = -1;  // exit code, or 1000 + signal
    std::string out, error;
};

/// A program that has been started; its output goes to files of `folder`.
class Started {
public:
    Started(const TemporaryFolder& folder, const std::vector<std::string>& words)
        : out_(folder / "stdout.txt"), error_(folder / "stderr.txt") {
        std::vector<char*> arguments;
        for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
        arguments.push_back(nullptr);
        process_ = fork();
        if (process_ == 0) {
            // What it writes by a relative name goes away with the folder.
            if (chdir(folder.path().c_str()) != 0) _exit(126);
            dup2(open(out_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644), STDOUT_FILENO);
            dup2(open(error_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644), STDERR_FILENO);
            execvp(arguments[0], arguments.data());
            _exit(127);
        }
    }
    void signal(int number) const { ::kill(process_, number); }
    pid_t process() const { return process_; }
    Outcome wait() const {
        int status = 0;
        ::waitpid(process_, &status, 0);
        const int code = WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
        return {code, read(out_), read(error_)};
    }

private:
    std::filesystem::path out_, error_;
    pid_t process_ = -1;
};

inline std::vector<std::string> command(std::vector<std::string> words) {
    words.insert(words.begin(), SELDINGER_PROGRAM);
    return words;
}
inline Outcome run(const TemporaryFolder& folder, const std::vector<std::string>& words) {
    return Started(folder, command(words)).wait();
}

/// Words of a command with what it needs, and then `more`.
inline std::vector<std::string> joined(std::vector<std::string> words, const std::vector<std::string>& more) {
    words.insert(words.end(), more.begin(), more.end());
    return words;
}

/// Runs the program where no file may grow beyond so many blocks of 1024 bytes.
inline Outcome run_with_small_files(int blocks, const TemporaryFolder& folder,
                                    const std::vector<std::string>& words) {
    const std::string limited = "ulimit -f " + std::to_string(blocks) + "; exec \"$0\" \"$@\"";
    return Started(folder, joined({"bash", "-c", limited}, command(words))).wait();
}

/// Words of a run of `s_bend` into a folder, and more words.
inline std::vector<std::string> s_bend_run(const std::filesystem::path& out,
                                           const std::vector<std::string>& more = {},
                                           const std::string& script = good_script) {
    return joined({"run", "s_bend", "--commands", script, "--out", out}, more);
}

/// A run of `s_bend` into `out` of the folder that ends only when it is told to; it has recorded `frame`.
inline Started endless_run(const TemporaryFolder& folder, const std::string& out, int frame) {
    write(folder / "long.gw", "0 beam on\n1..30 advance 2 mm\n1000000 end\n");
    Started started(folder, command(s_bend_run(folder / out, {"--frames", "none"}, folder / "long.gw")));
    const std::string state = "state " + std::to_string(frame) + " ";
    while (read(folder / (out + "/run.gw")).find(state) == std::string::npos) std::this_thread::yield();
    return started;
}

/// What the program says as it does what it is told, with exit code 0.
inline Outcome succeeded(const TemporaryFolder& folder, const std::vector<std::string>& words,
                         const std::source_location& where = std::source_location::current()) {
    const Outcome result = run(folder, words);
    if (result.code != 0)
        ADD_FAILURE_AT(where.file_name(), static_cast<int>(where.line()))
            << "exit code " << result.code << ": " << result.out << result.error;
    return result;
}

/// The program refused its input with this in its message.
inline void expect_refused(const Outcome& result, const std::string& expected,
                           const std::source_location& where = std::source_location::current()) {
    EXPECT_EQ(result.code, 2) << result.out << result.error;
    // "seldinger run: " where the arguments are refused.
    const std::string named = result.error.substr(0, result.error.find(": "));
    EXPECT_TRUE(named.starts_with("seldinger") &&
                named.find_first_not_of("abcdefghijklmnopqrstuvwxyz ") == std::string::npos)
        << result.error;
    expect_said(result.error, expected, where);
}

}  // namespace test
