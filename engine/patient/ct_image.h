#pragma once
/// A CT of a patient, as files hold it: Hounsfield units on a grid, in the patient's coordinates.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "render/xray/volume.h"

namespace patient {

/// What scanners state at most (12 bits): values beyond are set to the nearer limit, metal among them.
inline constexpr int lowest_hu = -1024, highest_hu = 3071;
/// A CT of more samples is refused: it would need more than 2.4 GB of memory.
inline constexpr double most_samples = 6e8;

struct CtImage {
    render::VolumeGrid grid;       // in coordinates as of DICOM: +x left, +y back, +z head [mm]
    std::vector<std::int16_t> hu;  // i fastest, then j, then k
};

/// Called with 0 to 1 while something takes long, and with what it is.
using Progress = std::function<void(double part, const char* what)>;

/// Reads NIfTI (.nii, .nii.gz), NRRD (.nrrd, .nhdr) or a folder of DICOM files. `series`: for a folder that
/// holds several, the UID of one or the beginning of its number or description. Throws InputError for a file
/// that is missing, damaged, of another kind, too large, or not a CT in a place.
CtImage read_ct(const std::filesystem::path&, const std::string& series = {}, const Progress& = {});

}  // namespace patient
