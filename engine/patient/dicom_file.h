#pragma once
/// Slices of a CT in DICOM files, one or many in each.

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "engine/patient/ct_samples.h"
#include "physics/geometry/vec.h"

namespace patient {

/// One slice, without its samples.
struct DicomSlice {
    std::filesystem::path file;
    int frame = 0;    // of the file
    std::string uid;  // SOPInstanceUID of the file
    std::string series, number, description;
    int columns = 0, rows = 0;
    geometry::Vec3 position, along_row, along_column;  // of the first sample; unit vectors
    double column_step = 0, row_step = 0;              // between columns, and between rows [mm]
    Rescale rescale;
};

bool has_dicom_mark(const std::filesystem::path&);

/// The slices of a file: one, or all frames of an enhanced CT; none for a file that is no image of a CT, such
/// as a report or a survey view. Throws InputError.
std::vector<DicomSlice> dicom_slices(const std::filesystem::path&);

/// Reads slices of one file; `to` has the place of the first sample of each. Throws InputError.
void read_dicom_slices(std::span<const DicomSlice* const>, std::span<std::int16_t* const> to);

}  // namespace patient
