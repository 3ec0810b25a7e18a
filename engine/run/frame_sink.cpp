#include "engine/run/frame_sink.h"

#include <fmt/format.h>
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

PngFolder::PngFolder(std::filesystem::path folder) : folder_(std::move(folder)) {}

void PngFolder::accept(int frame, const render::GrayImage& image) {
    queue_.put([path = folder_ / frame_file_name(frame), image] { write_picture(path, image); });
}

void PngFolder::accept(int frame, const render::ColourImage& image) {
    queue_.put([path = folder_ / frame_file_name(frame), image] { write_picture(path, image); });
}

void PngFolder::finish() {
    queue_.finish();
}

void WriteQueue::work() {
    std::unique_lock lock(mutex_);
    while (true) {
        changed_.wait(lock, [this] { return closing_ || !waiting_.empty(); });
        if (waiting_.empty()) return;
        const std::function<void()> task = std::move(waiting_.front());
        waiting_.pop_front();
        changed_.notify_all();
        if (failure_) continue;
        lock.unlock();
        std::exception_ptr failed;
        try {
            task();
        } catch (...) {
            failed = std::current_exception();
        }
        lock.lock();
        if (failed) failure_ = failed;
    }
}

void WriteQueue::close() {
    {
        const std::lock_guard lock(mutex_);
        closing_ = true;
    }
    changed_.notify_all();
    if (thread_.joinable()) thread_.join();
}

void WriteQueue::put(std::function<void()> task) {
    constexpr std::size_t most_waiting = 2;  // what waits is still written when the run is interrupted
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return waiting_.size() < most_waiting; });
    if (failure_) std::rethrow_exception(failure_);
    waiting_.push_back(std::move(task));
    changed_.notify_all();
}

void WriteQueue::finish() {
    close();
    if (failure_) std::rethrow_exception(failure_);
}

}  // namespace run
