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

/// Where the samples of a slice or frame lie.
struct DicomPlane {
    geometry::Vec3 position, along_row, along_column;  // of the first sample; unit vectors
    double column_step = 0, row_step = 0;              // between columns, and between rows [mm]

    geometry::Vec3 normal() const { return along_row.cross(along_column).normalized(); }
};

/// One slice, without its samples.
struct DicomSlice : DicomPlane {
    std::filesystem::path file;
    int frame = 0;    // of the file
    std::string uid;  // SOPInstanceUID of the file
    std::string series, number, description;
    int columns = 0, rows = 0;
    std::string frame_of_reference;
    Rescale rescale;
};

/// Whether the file begins as DICOM does: with its mark, or, as some programs leave it out, with elements of
/// the group that a data set begins with.
bool is_dicom_file(const std::filesystem::path&);

/// The slices of a file: one, or all frames of an enhanced CT; none for a file that is no image of a CT, such
/// as a report or a survey view. Throws InputError.
std::vector<DicomSlice> dicom_slices(const std::filesystem::path&);

/// Reads slices of one file; `to` has the place of the first sample of each. Throws InputError.
void read_dicom_slices(std::span<const DicomSlice* const>, std::span<std::int16_t* const> to,
                       SampleFindings&);

}  // namespace patient
