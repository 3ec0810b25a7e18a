#pragma once
/// The folder that a run leaves behind: run.gw, score.json, sheet.png, and for its frames frames/, panel/ and
/// truth/ with frame_000123.png and the like, dicom/ with xa_0001.dcm, one for each stretch of beam at one
/// pose, and slicer/ with markups.

#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include "engine/dicom/angiogram.h"
#include "engine/exercise/frame.h"
#include "engine/exercise/monitor.h"
#include "engine/io/files.h"
#include "engine/script/command.h"
#include "render/picture/image.h"

namespace run {

/// Identifies a run before it begins: the program, who plays, scenario and anatomy, and all commands.
std::uint64_t study_of(const script::Origin&, const script::CommandScript&);

/// xa_0001.dcm
std::string angiogram_file_name(int number);
/// Whether a file has such a name.
bool is_angiogram_file_name(const std::string&);

class AngiogramFolder {
public:
    /// `origin` with the names and hashes of scenario and anatomy; `every`: frames between two images. The
    /// folder must exist, and the script, which is that of the run, must outlive this.
    AngiogramFolder(std::filesystem::path folder, dicom::Pixels, dicom::Identity, const script::Origin&,
                    const script::CommandScript&, int every);

    /// Adds the image of a frame if a pulse was taken since the last one; writes the object before when this
    /// one does not continue it. Throws InputError when that fails.
    void take(const exercise::Frame&, exercise::Monitor&, const render::GrayImage& shown);
    /// Writes the last one.
    void finish();

private:
    std::optional<double> agent_at(int frame) const;
    bool continues(const exercise::Frame&, const exercise::Pulse&) const;
    void begin(const exercise::Frame&, const exercise::Pulse&);

    std::filesystem::path folder_;
    dicom::Pixels pixels_;
    dicom::Identity identity_;
    script::Origin origin_;
    const script::CommandScript& script_;
    std::uint64_t study_;
    int every_, number_ = 0;
    int last_pulse_ = -1, last_attempt_ = -1;  // frame of the run, frame of the attempt
    script::ImagingMode mode_ = script::ImagingMode::Live;
    std::optional<dicom::Angiogram> open_;
};

/// Throws InputError when writing to `out` would destroy the script being run or the run to compare with.
void refuse_to_overwrite(const std::filesystem::path& out, const std::filesystem::path& script,
                         const std::optional<std::filesystem::path>& expected);

/// Throws InputError when a run into `out`, or its trace where one is asked for, would replace or remove one
/// of the inputs, or when the trace is one of the run's own files.
void refuse_to_replace(std::span<const std::filesystem::path> inputs, const std::filesystem::path& out,
                       const std::filesystem::path& trace);

class OutputFolder {
public:
    /// The parts of each frame to keep.
    struct Parts {
        bool frames = true, panel = false, truth = false, dicom = false, slicer = false;
    };
    /// Makes the folder, unless it is there, and has it for this process alone; nothing in it changes. Throws
    /// InputError, as io::OwnFolder.
    OutputFolder(std::filesystem::path, Parts);
    /// Removes the files of an earlier run; other files stay. To be called once nothing can be refused any
    /// more. Throws InputError.
    void take_out_earlier_run() const;
    /// Until it is called, the end removes folders made here that are still empty.
    void keep() { own_.keep(); }

    std::filesystem::path recording() const { return own_.path() / "run.gw"; }
    std::filesystem::path frames() const { return own_.path() / "frames"; }
    std::filesystem::path panel() const { return own_.path() / "panel"; }
    std::filesystem::path truth() const { return own_.path() / "truth"; }
    std::filesystem::path dicom() const { return own_.path() / "dicom"; }
    std::filesystem::path slicer() const { return own_.path() / "slicer"; }
    void write_score(const std::string& json) const;
    void write_sheet(const render::GrayImage&) const;

private:
    io::OwnFolder own_;
};

}  // namespace run
