#pragma once
/// Work without the interpreter, and what becomes of it when Python ends.

#include <condition_variable>
#include <mutex>
#include <new>
#include <pthread.h>
#include <pybind11/pybind11.h>
#include <thread>
#include <unistd.h>

namespace app {

/// The end of Python. A thread that asks for the interpreter after that is ended by it in the middle of C++,
/// which ends the program. So when Python begins to end, calls that are under way come to the end of their
/// part, and threads other than the one that ends Python stop for ever before they take the interpreter back.
class Ending {
public:
    static Ending& get() {
        static auto* const one = new Ending;  // outlives all threads
        return *one;
    }
    /// To be called with the interpreter locked, by the thread that ends Python.
    void begin() {
        PyThreadState* const saved = PyEval_SaveThread();
        {
            std::unique_lock lock(mutex_);
            begun_ = true;
            by_ = std::this_thread::get_id();
            done_.wait(lock, [&] { return busy_ == 0; });
        }
        PyEval_RestoreThread(saved);
    }
    bool for_this_thread() {
        const std::lock_guard lock(mutex_);
        return begun_ && by_ != std::this_thread::get_id();
    }
    void leave_python() {
        const std::lock_guard lock(mutex_);
        ++busy_;
    }
    /// Does not return once Python ends.
    void before_return() {
        std::unique_lock lock(mutex_);
        if (!begun_ || by_ == std::this_thread::get_id()) return;
        --busy_;
        done_.notify_all();
        lock.unlock();
        for (;;) pause();
    }
    void returned() {
        const std::lock_guard lock(mutex_);
        --busy_;
        done_.notify_all();
    }
    /// In a process that was forked, which has none of the other threads.
    void forget() {
        new (&mutex_) std::mutex;
        new (&done_) std::condition_variable;
        busy_ = 0;
    }

private:
    std::mutex mutex_;
    std::condition_variable done_;
    int busy_ = 0;  // threads at work without the interpreter, or on their way back to it
    bool begun_ = false;
    std::thread::id by_;
};

/// Thrown out of long work when Python ends.
struct PythonEnds {};

/// Lets other threads of Python run while it exists. What this thread holds besides must be let go before it
/// ends.
class Free {
public:
    Free() {
        Ending::get().leave_python();
        state_ = PyEval_SaveThread();
        if (Ending::get().for_this_thread()) Ending::get().before_return();  // begins nothing more
    }
    ~Free() {
        Ending::get().before_return();
        PyEval_RestoreThread(state_);
        Ending::get().returned();
    }
    Free(const Free&) = delete;
    Free& operator=(const Free&) = delete;

private:
    PyThreadState* state_;
};

/// To be called once, by the module.
inline void follow_the_end_of_python() {
    pybind11::module_::import("atexit").attr("register")(
        pybind11::cpp_function([] { Ending::get().begin(); }));
    pthread_atfork(nullptr, nullptr, [] { Ending::get().forget(); });
}

}  // namespace app
