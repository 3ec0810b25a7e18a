#pragma once
/// Vessels from the files of segmentation programs and from contrast in a CT.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "engine/anatomy/import/lumen_import.h"
#include "engine/patient/ct_image.h"

namespace anatomy {

/// A CT that a vessel lies in, and where to begin in it.
struct MaskSource {
    std::vector<std::filesystem::path> masks;  // their union; empty = grown in the CT
    std::vector<std::string> labels;           // numbers or names of segments; empty = the only one
    std::filesystem::path ct;                  // empty = none
    std::string series;                        // of a folder of DICOM files
    std::optional<geometry::Vec3> seed;        // in the contrast of the CT [mm]
    std::optional<double> threshold;           // least of the contrast [HU]
    bool any_frame = false;  // masks of another frame of reference than the CT's lie in the same place
};

/// Whether the file is a volume, which may hold a mask.
bool is_mask_file(const std::filesystem::path&);
/// The file's name without its ending: "aorta" of aorta.seg.nrrd and aorta.nii.gz.
std::string stem_of_mask(const std::filesystem::path&);

/// The lumen of a mask in the patient's coordinates, smooth, with its ends open. Throws InputError for a mask
/// that is empty, not a mask, of several labels none of which was chosen, in large pieces, or of another
/// place or frame of reference than the CT.
ImportedLumen import_mask(const MaskSource&, const ImportOptions&);

/// What patient::require_fit says of the vessels and the CT. Throws InputError where they are not of one
/// patient.
std::vector<Finding> compare_with_ct(const geometry::TriangleMesh&, const patient::CtImage&,
                                     const std::filesystem::path& ct);

}  // namespace anatomy
