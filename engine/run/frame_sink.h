#pragma once
/// Where the frames of a run go.

#include <filesystem>
#include <string>

#include "engine/run/write_queue.h"
#include "render/picture/image.h"

namespace run {

class FrameSink {
public:
    virtual ~FrameSink() = default;
    /// Takes a frame. Throws InputError when this frame or an earlier one failed.
    virtual void accept(int frame, const render::GrayImage&) = 0;
    /// Returns when all frames have reached their destination. Throws like accept.
    virtual void finish() = 0;
};

/// frame_000123.png
std::string frame_file_name(int frame);
/// The frame that such a name belongs to, -1 for any other name.
int frame_of_file_name(const std::string&);

/// Writes PNG files on a thread of its own.
class PngFolder final : public FrameSink {
public:
    explicit PngFolder(std::filesystem::path folder);  // the folder must exist

    void accept(int frame, const render::GrayImage&) override;
    void accept(int frame, const render::ColourImage&);
    void finish() override;

private:
    std::filesystem::path folder_;
    WriteQueue queue_;
};

}  // namespace run
