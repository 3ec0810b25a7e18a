#pragma once
/// Writes pictures to files and reads them back; numbers per pixel as images of 16 bits. Frames of
/// a run are written in order on a thread of their own.

#include <condition_variable>
#include <deque>
#include <exception>
#include <filesystem>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "render/picture/image.h"
#include "render/xray/c_arm.h"

namespace run {

/// Writes a PNG that is either complete or absent: see write_whole. Throws InputError.
void write_picture(const std::filesystem::path&, const render::GrayImage&);
void write_picture(const std::filesystem::path&, const render::DeepImage&);
void write_picture(const std::filesystem::path&, const render::ColourImage&);

/// Reads a grey PNG. Throws InputError.
render::GrayImage read_picture(const std::filesystem::path&);

/// Quanta that a level of a stored signal stands for, where the detector's pulse has `dose` [nGy]: that dose
/// is level 4096, a sixteenth of the range, for lung and direct radiation lie above.
double quanta_per_level(const render::CArm&, double dose);

/// Each value over `per_level`, to the nearest level; what is below 0 or no number is 0, what exceeds 65535
/// is cut off.
render::DeepImage deep_picture(const render::Field&, double per_level);

/// At most a few tasks wait, so that a slow disk slows the run down instead of filling the memory.
class WriteQueue {
public:
    WriteQueue() : thread_([this] { work(); }) {}
    /// Waits for what was put in; errors are lost.
    ~WriteQueue() { close(); }

    /// Throws what an earlier task threw; after such a failure nothing more is done.
    void put(std::function<void()> task);
    /// Returns when all is done. Throws like put. Nothing may be put in later.
    void finish();

private:
    void work();
    void close();

    std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<std::function<void()>> waiting_;  // guarded by the mutex, like what follows
    bool closing_ = false;
    std::exception_ptr failure_;
    std::thread thread_;  // last: it uses all others
};

/// frame_000123.png
std::string frame_file_name(int frame);
/// The frame that such a name belongs to, -1 for any other name.
int frame_of_file_name(const std::string&);

/// Writes PNG files on a thread of its own.
class PngFolder {
public:
    explicit PngFolder(std::filesystem::path folder);  // the folder must exist

    /// Takes a frame. Throws InputError when this frame or an earlier one failed.
    void accept(int frame, const render::GrayImage&);
    void accept(int frame, const render::ColourImage&);
    /// Returns when all frames are written. Throws like accept.
    void finish();

private:
    std::filesystem::path folder_;
    WriteQueue queue_;
};

}  // namespace run
