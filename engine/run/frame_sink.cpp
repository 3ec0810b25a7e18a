#include "engine/run/frame_sink.h"

#include <condition_variable>
#include <deque>
#include <exception>
#include <fmt/format.h>
#include <mutex>
#include <thread>
#include <utility>

#include "engine/io/text.h"
#include "engine/run/picture_file.h"

namespace run {

std::string frame_file_name(int frame) {
    return fmt::format("frame_{:06}.png", frame);
}

int frame_of_file_name(const std::string& name) {
    if (!name.starts_with("frame_") || !name.ends_with(".png") || name.size() <= 10) return -1;
    const auto number = io::parse_integer(std::string_view(name).substr(6, name.size() - 10));
    return number && *number >= 0 && frame_file_name(*number) == name ? *number : -1;
}

struct PngFolder::Worker {
    static constexpr std::size_t most_waiting = 8;

    std::filesystem::path folder;
    std::mutex mutex;
    std::condition_variable changed;
    std::deque<std::pair<int, Picture>> waiting;  // guarded by mutex, like everything below
    bool closing = false;
    std::exception_ptr failure;
    std::thread thread;

    void work() {
        std::unique_lock lock(mutex);
        while (true) {
            changed.wait(lock, [this] { return closing || !waiting.empty(); });
            if (waiting.empty()) return;
            const auto [frame, picture] = std::move(waiting.front());
            waiting.pop_front();
            changed.notify_all();
            if (failure) continue;  // after one failure nothing more is written
            lock.unlock();
            std::exception_ptr failed;
            try {
                std::visit(
                    [&, number = frame](const auto& pixels) {
                        write_picture(folder / frame_file_name(number), pixels);
                    },
                    picture);
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

PngFolder::PngFolder(std::filesystem::path folder) : worker_(std::make_unique<Worker>()) {
    worker_->folder = std::move(folder);
    worker_->thread = std::thread([worker = worker_.get()] { worker->work(); });
}

PngFolder::~PngFolder() {
    worker_->close();
}

void PngFolder::accept(int frame, const render::GrayImage& image) {
    enqueue(frame, image);
}

void PngFolder::accept(int frame, const render::ColourImage& image) {
    enqueue(frame, image);
}

void PngFolder::enqueue(int frame, Picture picture) {
    std::unique_lock lock(worker_->mutex);
    worker_->changed.wait(lock, [this] { return worker_->waiting.size() < Worker::most_waiting; });
    if (worker_->failure) std::rethrow_exception(worker_->failure);
    worker_->waiting.emplace_back(frame, std::move(picture));
    worker_->changed.notify_all();
}

void PngFolder::finish() {
    worker_->close();
    if (worker_->failure) std::rethrow_exception(worker_->failure);
}

}  // namespace run
