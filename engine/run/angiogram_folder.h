#pragma once
/// The images of a run as DICOM objects: xa_0001.dcm and so on, one for each stretch of beam at one pose.

#include <filesystem>
#include <optional>

#include "engine/dicom/angiogram.h"
#include "engine/exercise/frame.h"
#include "engine/exercise/monitor.h"
#include "engine/script/command.h"

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
    AngiogramFolder(std::filesystem::path folder, dicom::Pixels, const script::Origin&,
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
    script::Origin origin_;
    const script::CommandScript& script_;
    std::uint64_t study_;
    int every_, number_ = 0;
    int last_pulse_ = -1, last_attempt_ = -1;  // frame of the run, frame of the attempt
    script::ImagingMode mode_ = script::ImagingMode::Live;
    std::optional<dicom::Angiogram> open_;
};

}  // namespace run
