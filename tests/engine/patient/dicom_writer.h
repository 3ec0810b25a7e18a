#pragma once
/// Writes the slices of a CT as a scanner would, with DCMTK.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <dcmtk/dcmdata/dcpixel.h>
#include <dcmtk/dcmdata/dcpixseq.h>
#include <dcmtk/dcmdata/dcpxitem.h>
#include <dcmtk/dcmdata/dctk.h>
#include <filesystem>
#include <fmt/format.h>
#include <functional>
#include <openjpeg.h>
#include <string>
#include <vector>

#include "engine/patient/ct_image.h"

namespace test {

struct DicomSeries {
    std::string uid = "1.2.826.0.1.3680043.2.1143.1", number = "3", description = "ANGIO 0.75";
    bool with_sign = false;     // of stored values; else from 0 with an intercept of −1024
    std::vector<int> left_out;  // slices
    std::string modality = "CT";
    bool shuffled = true;    // names do not follow positions
    bool jpeg2000 = false;   // lossless
    bool enhanced = false;   // all slices as frames of one file
    std::vector<double> at;  // places of slices along the grid's last axis, in its steps; empty = 0, 1, 2, …
    double rounded = 0;      // positions are written in multiples of this [mm]
    std::string frame_of_reference = "1.2.826.0.1.3680043.2.1143.9";
    std::function<void(DcmDataset&, int k)> change = {};  // of a slice, last of all
    E_TransferSyntax syntax = EXS_LittleEndianExplicit;   // of one whose samples are as they were put
};

/// A code stream of JPEG 2000, lossless.
inline std::vector<std::uint8_t> jpeg2000_of(const std::vector<Uint16>& samples, int columns, int rows,
                                             bool with_sign) {
    opj_cparameters_t parameters;
    opj_set_default_encoder_parameters(&parameters);
    parameters.numresolution = 2;
    opj_image_cmptparm_t component{};
    component.dx = component.dy = 1;
    component.w = static_cast<OPJ_UINT32>(columns), component.h = static_cast<OPJ_UINT32>(rows);
    component.prec = with_sign ? 16 : 12;
    component.sgnd = with_sign;
    opj_image_t* image = opj_image_create(1, &component, OPJ_CLRSPC_GRAY);
    image->x1 = component.w, image->y1 = component.h;
    for (std::size_t i = 0; i < samples.size(); ++i)
        image->comps[0].data[i] = with_sign ? static_cast<std::int16_t>(samples[i]) : samples[i];
    opj_codec_t* codec = opj_create_compress(OPJ_CODEC_J2K);
    std::vector<std::uint8_t> code;
    opj_stream_t* stream = opj_stream_default_create(OPJ_FALSE);
    opj_stream_set_user_data(stream, &code, nullptr);
    opj_stream_set_write_function(stream, [](void* from, OPJ_SIZE_T bytes, void* to) {
        const auto* const first = static_cast<std::uint8_t*>(from);
        static_cast<std::vector<std::uint8_t>*>(to)->insert(
            static_cast<std::vector<std::uint8_t>*>(to)->end(), first, first + bytes);
        return bytes;
    });
    const bool made = opj_setup_encoder(codec, &parameters, image) &&
                      opj_start_compress(codec, image, stream) && opj_encode(codec, stream) &&
                      opj_end_compress(codec, stream);
    opj_stream_destroy(stream);
    opj_destroy_codec(codec);
    opj_image_destroy(image);
    if (!made) throw std::runtime_error("OpenJPEG wrote nothing");
    return code;
}

/// Stores samples of frames; the syntax to save the file in.
inline E_TransferSyntax put_samples(DcmDataset& data, const std::vector<std::vector<Uint16>>& frames,
                                    int columns, int rows, const DicomSeries& series) {
    if (!series.jpeg2000) {
        std::vector<Uint16> all;
        for (const std::vector<Uint16>& frame : frames) all.insert(all.end(), frame.begin(), frame.end());
        data.putAndInsertUint16Array(DCM_PixelData, all.data(), static_cast<unsigned long>(all.size()));
        return series.syntax;
    }
    auto* const fragments = new DcmPixelSequence(DCM_PixelSequenceTag);
    auto* const offsets = new DcmPixelItem(DCM_PixelItemTag);
    fragments->insert(offsets);
    DcmOffsetList list;
    for (const std::vector<Uint16>& frame : frames) {
        const std::vector<std::uint8_t> code = jpeg2000_of(frame, columns, rows, series.with_sign);
        fragments->storeCompressedFrame(list, const_cast<Uint8*>(code.data()),
                                        static_cast<Uint32>(code.size()), 0);
    }
    auto* const pixels = new DcmPixelData(DCM_PixelData);
    pixels->putOriginalRepresentation(EXS_JPEG2000LosslessOnly, nullptr, fragments);
    data.insert(pixels);
    return EXS_JPEG2000LosslessOnly;
}

/// One file a slice, IMnnnn, or one of all.
inline void write_dicom(const std::filesystem::path& folder, const patient::CtImage& ct,
                        const DicomSeries& series = {}) {
    std::filesystem::create_directories(folder);
    const render::VolumeGrid& grid = ct.grid;
    const auto triple = [](const geometry::Vec3& v) {
        return fmt::format("{:.6f}\\{:.6f}\\{:.6f}", v[0], v[1], v[2]);
    };
    const auto put = [](DcmItem& data, const DcmTagKey& tag, const std::string& text) {
        if (data.putAndInsertString(tag, text.c_str()).bad()) throw std::runtime_error("DCMTK: " + text);
    };
    const auto position = [&](int k) {
        geometry::Vec3 x = grid.at(0, 0, 0) +
                           (series.at.empty() ? k : series.at[static_cast<std::size_t>(k)]) * grid.steps[2];
        if (series.rounded > 0) x = series.rounded * (x / series.rounded).array().round().matrix();
        return triple(x);
    };
    const std::string turn = triple(grid.steps[0].normalized()) + "\\" + triple(grid.steps[1].normalized());
    const std::string spacing = fmt::format("{:.6f}\\{:.6f}", grid.steps[1].norm(), grid.steps[0].norm());
    const auto samples = [&](int k) {
        std::vector<Uint16> stored;
        for (int j = 0; j < grid.size[1]; ++j)
            for (int i = 0; i < grid.size[0]; ++i)
                stored.push_back(
                    static_cast<Uint16>(ct.hu[grid.index(i, j, k)] + (series.with_sign ? 0 : 1024)));
        return stored;
    };
    const auto start = [&](DcmDataset& data, int k) {
        put(data, DCM_SOPClassUID, series.enhanced ? UID_EnhancedCTImageStorage : UID_CTImageStorage);
        put(data, DCM_SOPInstanceUID, fmt::format("{}.{}", series.uid, k + 1));
        put(data, DCM_StudyInstanceUID, "1.2.826.0.1.3680043.2.1143");
        put(data, DCM_SeriesInstanceUID, series.uid);
        put(data, DCM_SeriesNumber, series.number);
        if (!series.frame_of_reference.empty()) put(data, DCM_FrameOfReferenceUID, series.frame_of_reference);
        put(data, DCM_SeriesDescription, series.description);
        put(data, DCM_Modality, series.modality);
        put(data, DCM_ImageType,
            series.enhanced ? "ORIGINAL\\PRIMARY\\VOLUME\\NONE" : "ORIGINAL\\PRIMARY\\AXIAL");
        put(data, DCM_PhotometricInterpretation, "MONOCHROME2");
        data.putAndInsertUint16(DCM_Rows, static_cast<Uint16>(grid.size[1]));
        data.putAndInsertUint16(DCM_Columns, static_cast<Uint16>(grid.size[0]));
        data.putAndInsertUint16(DCM_SamplesPerPixel, 1);
        data.putAndInsertUint16(DCM_BitsAllocated, 16);
        data.putAndInsertUint16(DCM_BitsStored, series.with_sign ? 16 : 12);
        data.putAndInsertUint16(DCM_HighBit, series.with_sign ? 15 : 11);
        data.putAndInsertUint16(DCM_PixelRepresentation, series.with_sign ? 1 : 0);
    };
    const auto rescale = [&](DcmItem& item) {
        put(item, DCM_RescaleSlope, "1");
        put(item, DCM_RescaleIntercept, series.with_sign ? "0" : "-1024");
    };
    if (series.enhanced) {
        DcmFileFormat file;
        DcmDataset& data = *file.getDataset();
        start(data, 0);
        put(data, DCM_NumberOfFrames, std::to_string(grid.size[2]));
        DcmItem *shared = nullptr, *item = nullptr;
        data.findOrCreateSequenceItem(DCM_SharedFunctionalGroupsSequence, shared);
        shared->findOrCreateSequenceItem(DCM_PlaneOrientationSequence, item);
        put(*item, DCM_ImageOrientationPatient, turn);
        shared->findOrCreateSequenceItem(DCM_PixelMeasuresSequence, item);
        put(*item, DCM_PixelSpacing, spacing);
        shared->findOrCreateSequenceItem(DCM_PixelValueTransformationSequence, item);
        rescale(*item);
        std::vector<std::vector<Uint16>> frames;
        for (int n = 0; n < grid.size[2]; ++n) {
            const int k = series.shuffled ? grid.size[2] - 1 - n : n;
            DcmItem* own = nullptr;
            data.findOrCreateSequenceItem(DCM_PerFrameFunctionalGroupsSequence, own, -2);
            own->findOrCreateSequenceItem(DCM_PlanePositionSequence, item);
            put(*item, DCM_ImagePositionPatient, position(k));
            frames.push_back(samples(k));
        }
        const E_TransferSyntax syntax = put_samples(data, frames, grid.size[0], grid.size[1], series);
        if (file.saveFile((folder / "IM0000").c_str(), syntax).bad())
            throw std::runtime_error("no DICOM file was written");
        return;
    }
    for (int k = 0; k < grid.size[2]; ++k) {
        if (std::find(series.left_out.begin(), series.left_out.end(), k) != series.left_out.end()) continue;
        DcmFileFormat file;
        DcmDataset& data = *file.getDataset();
        start(data, k);
        put(data, DCM_ImagePositionPatient, position(k));
        put(data, DCM_ImageOrientationPatient, turn);
        put(data, DCM_PixelSpacing, spacing);
        rescale(data);
        const E_TransferSyntax syntax = put_samples(data, {samples(k)}, grid.size[0], grid.size[1], series);
        if (series.change) series.change(data, k);
        const int name = series.shuffled ? (7 * k + 3) % 1009 : k;
        if (file.saveFile((folder / fmt::format("IM{:04}", name)).c_str(), syntax).bad())
            throw std::runtime_error("no DICOM file was written");
    }
}

}  // namespace test
