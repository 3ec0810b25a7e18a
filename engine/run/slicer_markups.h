#pragma once
/// What a run leaves for 3D Slicer, in slicer/: each device as it lies at the end (wire.mrk.json), the way of
/// each tip (wire_tip.mrk.json) and each pose of the C-arm under which the beam was on, in their order
/// (c_arm_01.mrk.json), in the patient's coordinates.

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "engine/exercise/frame.h"
#include "render/xray/c_arm.h"

namespace run {

/// Whether a file has the name of one that is written here.
bool is_markup_name(const std::string&);

class SlicerMarkups {
public:
    /// The folder must exist.
    explicit SlicerMarkups(std::filesystem::path folder) : folder_(std::move(folder)) {}

    void take(const exercise::Frame&);
    /// Writes the files. Throws InputError.
    void finish() const;

private:
    struct Course {
        geometry::Polyline device, tip;  // as it lies now; places of the tip, a millimetre apart or more [mm]
    };

    std::filesystem::path folder_;
    std::map<script::DeviceRole, Course> courses_;
    std::vector<render::CArm> poses_;
};

}  // namespace run
