#pragma once
/// Writes the slices of a CT as a scanner would, with DCMTK.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <dcmtk/dcmdata/dctk.h>
#include <filesystem>
#include <fmt/format.h>
#include <string>
#include <vector>

#include "engine/patient/ct_image.h"

namespace test {

struct DicomSeries {
    std::string uid = "1.2.826.0.1.3680043.2.1143.1", number = "3", description = "ANGIO 0.75";
    bool with_sign = false;     // of stored values; else from 0 with an intercept of −1024
    std::vector<int> left_out;  // slices
    std::string modality = "CT";
    bool shuffled = true;  // names do not follow positions
};

/// One file a slice, IMnnnn.
inline void write_dicom(const std::filesystem::path& folder, const patient::CtImage& ct,
                        const DicomSeries& series = {}) {
    std::filesystem::create_directories(folder);
    const render::VolumeGrid& grid = ct.grid;
    const auto triple = [](const geometry::Vec3& v) {
        return fmt::format("{:.6f}\\{:.6f}\\{:.6f}", v[0], v[1], v[2]);
    };
    for (int k = 0; k < grid.size[2]; ++k) {
        if (std::find(series.left_out.begin(), series.left_out.end(), k) != series.left_out.end()) continue;
        DcmFileFormat file;
        DcmDataset& data = *file.getDataset();
        const auto put = [&](const DcmTagKey& tag, const std::string& text) {
            if (data.putAndInsertString(tag, text.c_str()).bad()) throw std::runtime_error("DCMTK: " + text);
        };
        put(DCM_SOPClassUID, UID_CTImageStorage);
        put(DCM_SOPInstanceUID, fmt::format("{}.{}", series.uid, k + 1));
        put(DCM_StudyInstanceUID, "1.2.826.0.1.3680043.2.1143");
        put(DCM_SeriesInstanceUID, series.uid);
        put(DCM_SeriesNumber, series.number);
        put(DCM_SeriesDescription, series.description);
        put(DCM_Modality, series.modality);
        put(DCM_ImageType, "ORIGINAL\\PRIMARY\\AXIAL");
        put(DCM_ImagePositionPatient, triple(grid.at(0, 0, k)));
        put(DCM_ImageOrientationPatient,
            triple(grid.steps[0].normalized()) + "\\" + triple(grid.steps[1].normalized()));
        put(DCM_PixelSpacing, fmt::format("{:.6f}\\{:.6f}", grid.steps[1].norm(), grid.steps[0].norm()));
        put(DCM_RescaleSlope, "1");
        put(DCM_RescaleIntercept, series.with_sign ? "0" : "-1024");
        put(DCM_PhotometricInterpretation, "MONOCHROME2");
        data.putAndInsertUint16(DCM_Rows, static_cast<Uint16>(grid.size[1]));
        data.putAndInsertUint16(DCM_Columns, static_cast<Uint16>(grid.size[0]));
        data.putAndInsertUint16(DCM_SamplesPerPixel, 1);
        data.putAndInsertUint16(DCM_BitsAllocated, 16);
        data.putAndInsertUint16(DCM_BitsStored, series.with_sign ? 16 : 12);
        data.putAndInsertUint16(DCM_HighBit, series.with_sign ? 15 : 11);
        data.putAndInsertUint16(DCM_PixelRepresentation, series.with_sign ? 1 : 0);
        std::vector<Uint16> stored;
        for (int j = 0; j < grid.size[1]; ++j)
            for (int i = 0; i < grid.size[0]; ++i)
                stored.push_back(
                    static_cast<Uint16>(ct.hu[grid.index(i, j, k)] + (series.with_sign ? 0 : 1024)));
        data.putAndInsertUint16Array(DCM_PixelData, stored.data(), static_cast<unsigned long>(stored.size()));
        const int name = series.shuffled ? (7 * k + 3) % 1009 : k;
        if (file.saveFile((folder / fmt::format("IM{:04}", name)).c_str(), EXS_LittleEndianExplicit).bad())
            throw std::runtime_error("no DICOM file was written");
    }
}

}  // namespace test
