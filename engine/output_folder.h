#pragma once
/// The folder that a run leaves behind: run.gw, score.json, sheet.png, frames/frame_000123.png.

#include <filesystem>
#include <optional>
#include <string>

#include "render/image.h"

namespace engine {

/// Throws InputError when writing to `out` would destroy the script being run or the run it is compared with.
void refuse_to_overwrite(const std::filesystem::path& out, const std::filesystem::path& script,
                         const std::optional<std::filesystem::path>& expected);

class OutputFolder {
public:
    /// Makes the folder and takes out of it what an earlier run left; other files stay. Throws InputError.
    OutputFolder(std::filesystem::path, bool with_images);
    /// Unless kept, folders made here that are still empty go.
    ~OutputFolder();
    OutputFolder(const OutputFolder&) = delete;
    OutputFolder& operator=(const OutputFolder&) = delete;
    void keep() { kept_ = true; }

    std::filesystem::path recording() const { return path_ / "run.gw"; }
    std::filesystem::path frames() const { return path_ / "frames"; }
    void write_score(const std::string& json) const;
    void write_sheet(const render::GrayImage&) const;

private:
    std::filesystem::path path_;
    bool made_ = false, kept_ = false;
};

}  // namespace engine
