#pragma once
/// The folder that a run leaves behind: run.gw, score.json, sheet.png, and for its frames frames/, panel/ and
/// truth/ with frame_000123.png and the like, and dicom/ with xa_0001.dcm.

#include <filesystem>
#include <optional>
#include <string>

#include "render/picture/image.h"

namespace run {

/// Throws InputError when writing to `out` would destroy the script being run or the run to compare with.
void refuse_to_overwrite(const std::filesystem::path& out, const std::filesystem::path& script,
                         const std::optional<std::filesystem::path>& expected);

class OutputFolder {
public:
    /// The parts of each frame to keep.
    struct Parts {
        bool frames = true, panel = false, truth = false, dicom = false;
    };
    /// Creates the folder and removes the files of an earlier run; other files stay. Throws InputError.
    OutputFolder(std::filesystem::path, Parts);
    /// Unless the run is kept, removes folders made here that are still empty.
    ~OutputFolder();
    OutputFolder(const OutputFolder&) = delete;
    OutputFolder& operator=(const OutputFolder&) = delete;
    void keep() { kept_ = true; }

    std::filesystem::path recording() const { return path_ / "run.gw"; }
    std::filesystem::path frames() const { return path_ / "frames"; }
    std::filesystem::path panel() const { return path_ / "panel"; }
    std::filesystem::path truth() const { return path_ / "truth"; }
    std::filesystem::path dicom() const { return path_ / "dicom"; }
    void write_score(const std::string& json) const;
    void write_sheet(const render::GrayImage&) const;

private:
    std::filesystem::path path_;
    bool made_ = false, kept_ = false;
};

}  // namespace run
