#include "engine/run/picture_file.h"

#include <algorithm>
#include <cstdint>
#include <fmt/format.h>
#include <stdexcept>
#include <utility>
#include <vector>

#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/io/wall.h"
#include "render/picture/png.h"
#include "render/xray/detector.h"

namespace run {
namespace {

void write(const std::filesystem::path& path, const std::vector<std::uint8_t>& bytes) {
    io::write_whole(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace

void write_picture(const std::filesystem::path& path, const render::GrayImage& image) {
    write(path, render::encode_png(image));
}
void write_picture(const std::filesystem::path& path, const render::DeepImage& image) {
    write(path, render::encode_png(image));
}
void write_picture(const std::filesystem::path& path, const render::ColourImage& image) {
    write(path, render::encode_png(image));
}

render::GrayImage read_picture(const std::filesystem::path& path) {
    io::require_no_device(path);
    const auto read = [&](const io::Progress&) {
        try {
            return render::read_png(path);
        } catch (const std::runtime_error& error) {
            throw io::InputError(error.what());
        }
    };
    return io::read_behind_wall(path, {}, read,
                                [](geometry::StateStream& s, render::GrayImage& image) { image.state(s); });
}

double quanta_per_level(const render::CArm& arm, double dose) {
    constexpr double level = 4096;
    const double pixel = render::pixel_width(arm);
    return dose * render::quanta_per_dose_and_area * pixel * pixel / level;
}

render::DeepImage deep_picture(const render::Field& field, double per_level) {
    render::DeepImage image{field.width, field.height, {}};
    image.pixels.reserve(field.values.size());
    const auto levels = static_cast<float>(1 / per_level);
    for (const float value : field.values) {
        const float level = value > 0 ? std::min(value * levels + 0.5f, 65535.0f) : 0.0f;
        image.pixels.push_back(static_cast<std::uint16_t>(level));
    }
    return image;
}

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
