#include "engine/run/write_queue.h"

#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

namespace run {

struct WriteQueue::Worker {
    static constexpr std::size_t most_waiting = 2;  // what waits is still written when the run is interrupted

    std::mutex mutex;
    std::condition_variable changed;
    std::deque<std::function<void()>> waiting;  // guarded by mutex, like everything below
    bool closing = false;
    std::exception_ptr failure;
    std::thread thread;

    void work() {
        std::unique_lock lock(mutex);
        while (true) {
            changed.wait(lock, [this] { return closing || !waiting.empty(); });
            if (waiting.empty()) return;
            const std::function<void()> task = std::move(waiting.front());
            waiting.pop_front();
            changed.notify_all();
            if (failure) continue;
            lock.unlock();
            std::exception_ptr failed;
            try {
                task();
            } catch (...) {
                failed = std::current_exception();
            }
            lock.lock();
            if (failed) failure = failed;
        }
    }
    void close() {
        {
            const std::lock_guard lock(mutex);
            closing = true;
        }
        changed.notify_all();
        if (thread.joinable()) thread.join();
    }
};

WriteQueue::WriteQueue() : worker_(std::make_unique<Worker>()) {
    worker_->thread = std::thread([worker = worker_.get()] { worker->work(); });
}

WriteQueue::~WriteQueue() {
    worker_->close();
}

void WriteQueue::put(std::function<void()> task) {
    std::unique_lock lock(worker_->mutex);
    worker_->changed.wait(lock, [this] { return worker_->waiting.size() < Worker::most_waiting; });
    if (worker_->failure) std::rethrow_exception(worker_->failure);
    worker_->waiting.push_back(std::move(task));
    worker_->changed.notify_all();
}

void WriteQueue::finish() {
    worker_->close();
    if (worker_->failure) std::rethrow_exception(worker_->failure);
}

}  // namespace run
