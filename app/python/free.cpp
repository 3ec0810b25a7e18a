#include "app/python/free.h"

#include <condition_variable>
#include <mutex>
#include <pybind11/pybind11.h>
#include <thread>
#include <unistd.h>

#include "engine/io/error.h"

namespace app {
namespace {

/// Whether this thread has a Free.
thread_local bool within = false;
/// This thread's Calls and its Free.
thread_local int own = 0;

/// Who is at work in calls from Python, with or without the interpreter, whether Python ends, and who forks.
class Work {
public:
    static Work& get() { return *current(); }

    /// With the interpreter. A thread that is not to go on stops here for ever.
    void enter() {
        std::unique_lock lock(mutex_);
        if (ends_ && !by_us(ender_)) {
            lock.unlock();
            PyEval_SaveThread();
            lock.lock();
            stop(lock);
        }
        ++busy_;
        ++own;
    }
    void leave() {
        const std::lock_guard lock(mutex_);
        --busy_;
        --own;
        changed_.notify_all();
    }

    /// To be called without the interpreter. A thread that is not to go on stops here for ever.
    void begin() {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return !forking_ || by_us(forker_); });
        if (ends_ && !by_us(ender_)) stop(lock);
        ++busy_;
        ++own;
        ++working_;
    }
    /// The same, when no lock of the engine is held any more; leave() follows with the interpreter.
    void end() {
        std::unique_lock lock(mutex_);
        --working_;
        changed_.notify_all();
        if (ends_ && !by_us(ender_)) stop(lock);
    }

    /// With the interpreter, by the thread that ends Python.
    void python_ends() {
        PyThreadState* const saved = PyEval_SaveThread();
        {
            std::unique_lock lock(mutex_);
            ends_ = true;
            ender_ = std::this_thread::get_id();
            changed_.wait(lock, [&] { return busy_ == own; });
        }
        PyEval_RestoreThread(saved);
    }
    bool ends_for_this_thread() {
        const std::lock_guard lock(mutex_);
        return ends_ && !by_us(ender_);
    }

    /// With the interpreter, by the thread that forks. One that is at work itself, in a signal's handler,
    /// waits for nobody: another may wait for it.
    void before_fork() {
        if (within) return;
        PyThreadState* const saved = PyEval_SaveThread();
        {
            std::unique_lock lock(mutex_);
            changed_.wait(lock, [&] { return !forking_; });
            forking_ = true;
            forker_ = std::this_thread::get_id();
            changed_.wait(lock, [&] { return working_ == 0; });
        }
        PyEval_RestoreThread(saved);
    }
    void forked_in_parent() {
        if (within) return;
        const std::lock_guard lock(mutex_);
        forking_ = false;
        changed_.notify_all();
    }
    /// The child has none of the other threads, so their count, and what waits for them, is left behind.
    static void forked_in_child() {
        const Work& old = *current();
        auto* const now = new Work;
        now->ends_ = old.ends_;
        now->ender_ = old.ender_;
        now->busy_ = own;
        now->working_ = within ? 1 : 0;
        now->torn_ = within && old.working_ > 1;
        current() = now;
    }
    /// Whether other threads' locks may be closed for ever in this process.
    bool torn() {
        const std::lock_guard lock(mutex_);
        return torn_;
    }

private:
    static Work*& current() {
        static Work* one = new Work;  // outlives all threads
        return one;
    }
    static bool by_us(std::thread::id thread) { return thread == std::this_thread::get_id(); }
    [[noreturn]] void stop(std::unique_lock<std::mutex>& lock) {
        busy_ -= own;
        changed_.notify_all();
        lock.unlock();
        for (;;) pause();
    }

    std::mutex mutex_;
    std::condition_variable changed_;
    int working_ = 0;  // threads with a Free
    int busy_ = 0;     // calls of all threads, and their Frees
    bool ends_ = false, forking_ = false, torn_ = false;
    std::thread::id ender_, forker_;
};

void require_whole() {
    if (Work::get().torn())
        throw io::InputError(
            "this process was forked by a signal's handler while other threads were at work, whose locks "
            "stay closed in it; expected a process that was started anew ('spawn' in Python)");
}

}  // namespace

Call::Call() {
    Work::get().enter();
}

Call::~Call() {
    Work::get().leave();
}

Free::Free() {
    if (within)
        throw io::InputError(
            "a signal's handler or a finaliser called the simulator while its thread was at work in it; "
            "expected calls after that call has ended");
    require_whole();
    state_ = PyEval_SaveThread();
    Work::get().begin();
    within = true;
}

Free::~Free() {
    within = false;
    Work::get().end();
    PyEval_RestoreThread(static_cast<PyThreadState*>(state_));
    Work::get().leave();
}

void look_after_python() {
    if (Work::get().ends_for_this_thread()) throw PythonEnds();
    const pybind11::gil_scoped_acquire held;
    if (PyErr_CheckSignals() != 0) throw pybind11::error_already_set();
    require_whole();
}

void follow_python() {
    namespace py = pybind11;
    const auto call = [](auto function) { return py::cpp_function(function); };
    py::module_::import("atexit").attr("register")(call([] { Work::get().python_ends(); }));
    py::module_::import("os").attr("register_at_fork")(
        py::arg("before") = call([] { Work::get().before_fork(); }),
        py::arg("after_in_parent") = call([] { Work::get().forked_in_parent(); }),
        py::arg("after_in_child") = call([] { Work::forked_in_child(); }));
}

}  // namespace app
