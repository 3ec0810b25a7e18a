#include "app/python/free.h"

#include <condition_variable>
#include <mutex>
#include <new>
#include <pybind11/pybind11.h>
#include <thread>
#include <unistd.h>

namespace app {
namespace {

/// Who is at work without the interpreter, and whether Python ends.
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

}  // namespace

Free::Free() {
    Ending::get().leave_python();
    state_ = PyEval_SaveThread();
    if (Ending::get().for_this_thread()) Ending::get().before_return();  // begins nothing more
}

Free::~Free() {
    Ending::get().before_return();
    PyEval_RestoreThread(static_cast<PyThreadState*>(state_));
    Ending::get().returned();
}

void require_python() {
    if (Ending::get().for_this_thread()) throw PythonEnds();
}

void follow_the_end_of_python() {
    namespace py = pybind11;
    py::module_::import("atexit").attr("register")(py::cpp_function([] { Ending::get().begin(); }));
    py::module_::import("os").attr("register_at_fork")(py::arg("after_in_child") =
                                                           py::cpp_function([] { Ending::get().forget(); }));
}

}  // namespace app
