#pragma once
/// Writes segmentations of DICOM with DCMTK, as dcmqi (3D Slicer) and highdicom write them.

#include <algorithm>
#include <cstdint>
#include <dcmtk/dcmdata/dcpixel.h>
#include <dcmtk/dcmdata/dcrleerg.h>
#include <dcmtk/dcmdata/dctk.h>
#include <filesystem>
#include <fmt/format.h>
#include <string>
#include <vector>

#include "render/xray/volume.h"

namespace test {

struct Segment {
    int number = 1;
    std::string label = "aorta";
    std::vector<std::uint8_t> marked;  // of a grid's samples: 0 or 1, of fractions 0 to 255
};

struct SegFile {
    std::string type = "BINARY";
    int bits = 1;
    bool all_slices = false;  // also those in which nothing is marked
    bool shuffled = false;
    bool flipped = false;          // from the head down
    bool shared_segment = false;   // one segment, named once for all frames
    bool shared_position = false;  // one slice
    double spacing = -1;           // between slices, as it is written; < 0 = the grid's, 0 = not
    int background = -1;           // of a label map in place of 0, as PixelPaddingValue; < 0 = 0
    std::string frame_of_reference = "1.2.826.0.1.3680043.2.1143.9";
    std::string sop_class = UID_SegmentationStorage, modality = "SEG";
    std::vector<double> moved = {};  // slices along the grid's last axis [mm]
    double rounded = 0;              // positions are written in multiples of this [mm]
    E_TransferSyntax syntax = EXS_LittleEndianExplicit;
};

inline void write_seg(const std::filesystem::path& path, const render::VolumeGrid& grid,
                      const std::vector<Segment>& segments, const SegFile& how = {}) {
    const auto put = [](DcmItem& data, const DcmTagKey& tag, const std::string& text) {
        if (data.putAndInsertString(tag, text.c_str()).bad()) throw std::runtime_error("DCMTK: " + text);
    };
    const auto triple = [](const geometry::Vec3& v) {
        return fmt::format("{:.6f}\\{:.6f}\\{:.6f}", v[0], v[1], v[2]);
    };
    const auto position = [&](int k) {
        geometry::Vec3 x = grid.at(0, 0, k);
        if (!how.moved.empty()) x += how.moved[static_cast<std::size_t>(k)] * grid.steps[2].normalized();
        if (how.rounded > 0) x = how.rounded * (x / how.rounded).array().round().matrix();
        return triple(x);
    };
    DcmFileFormat file;
    DcmDataset& data = *file.getDataset();
    put(data, DCM_SOPClassUID, how.sop_class);
    put(data, DCM_SOPInstanceUID, "1.2.826.0.1.3680043.2.1143.8.1");
    put(data, DCM_StudyInstanceUID, "1.2.826.0.1.3680043.2.1143");
    put(data, DCM_SeriesInstanceUID, "1.2.826.0.1.3680043.2.1143.8");
    if (!how.frame_of_reference.empty()) put(data, DCM_FrameOfReferenceUID, how.frame_of_reference);
    put(data, DCM_Modality, how.modality);
    put(data, DCM_ImageType, "DERIVED\\PRIMARY");
    put(data, DCM_PhotometricInterpretation, "MONOCHROME2");
    put(data, DCM_SegmentationType, how.type);
    if (how.type == "FRACTIONAL") {
        put(data, DCM_SegmentationFractionalType, "PROBABILITY");
        data.putAndInsertUint16(DCM_MaximumFractionalValue, 255);
    }
    data.putAndInsertUint16(DCM_Rows, static_cast<Uint16>(grid.size[1]));
    data.putAndInsertUint16(DCM_Columns, static_cast<Uint16>(grid.size[0]));
    data.putAndInsertUint16(DCM_SamplesPerPixel, 1);
    data.putAndInsertUint16(DCM_BitsAllocated, static_cast<Uint16>(how.bits));
    data.putAndInsertUint16(DCM_BitsStored, static_cast<Uint16>(how.bits));
    data.putAndInsertUint16(DCM_HighBit, static_cast<Uint16>(how.bits - 1));
    data.putAndInsertUint16(DCM_PixelRepresentation, 0);
    if (how.background >= 0)
        data.putAndInsertUint16(DCM_PixelPaddingValue, static_cast<Uint16>(how.background));
    DcmItem *shared = nullptr, *item = nullptr, *code = nullptr;
    for (const Segment& segment : segments) {
        data.findOrCreateSequenceItem(DCM_SegmentSequence, item, -2);
        item->putAndInsertUint16(DCM_SegmentNumber, static_cast<Uint16>(segment.number));
        put(*item, DCM_SegmentLabel, segment.label);
        item->findOrCreateSequenceItem(DCM_SegmentedPropertyTypeCodeSequence, code);
        put(*code, DCM_CodeMeaning, "Artery");
    }
    data.findOrCreateSequenceItem(DCM_SharedFunctionalGroupsSequence, shared);
    shared->findOrCreateSequenceItem(DCM_PlaneOrientationSequence, item);
    put(*item, DCM_ImageOrientationPatient,
        triple(grid.steps[0].normalized()) + "\\" + triple(grid.steps[1].normalized()));
    shared->findOrCreateSequenceItem(DCM_PixelMeasuresSequence, item);
    put(*item, DCM_PixelSpacing, fmt::format("{:.6f}\\{:.6f}", grid.steps[1].norm(), grid.steps[0].norm()));
    const double spacing = how.spacing < 0 ? grid.steps[2].norm() : how.spacing;
    put(*item, DCM_SliceThickness, fmt::format("{:.6f}", grid.steps[2].norm()));
    if (spacing > 0) put(*item, DCM_SpacingBetweenSlices, fmt::format("{:.6f}", spacing));
    if (how.shared_segment) {
        shared->findOrCreateSequenceItem(DCM_SegmentIdentificationSequence, item);
        item->putAndInsertUint16(DCM_ReferencedSegmentNumber, static_cast<Uint16>(segments.front().number));
    }
    const auto slice = static_cast<std::size_t>(grid.size[0]) * static_cast<std::size_t>(grid.size[1]);
    struct Frame {
        int k;
        std::size_t segment;
    };
    const bool is_map = how.type == "LABELMAP";
    std::vector<Frame> frames;
    for (std::size_t s = 0; s < (is_map ? 1 : segments.size()); ++s)
        for (int k = 0; k < grid.size[2]; ++k) {
            bool any = how.all_slices;
            for (std::size_t t = is_map ? 0 : s; t < (is_map ? segments.size() : s + 1); ++t)
                for (std::size_t i = 0; i < slice; ++i)
                    any = any || segments[t].marked[static_cast<std::size_t>(k) * slice + i] > 0;
            if (any) frames.push_back({how.flipped ? grid.size[2] - 1 - k : k, s});
        }
    if (how.flipped)
        for (Frame& frame : frames) frame.k = grid.size[2] - 1 - frame.k;
    if (how.flipped) std::reverse(frames.begin(), frames.end());
    if (how.shuffled)
        for (std::size_t i = 0; i < frames.size(); ++i)
            std::swap(frames[i], frames[(7 * i + 3) % frames.size()]);
    std::vector<Uint16> words;  // a value each
    for (const Frame& frame : frames) {
        DcmItem* own = nullptr;
        data.findOrCreateSequenceItem(DCM_PerFrameFunctionalGroupsSequence, own, -2);
        own->findOrCreateSequenceItem(DCM_FrameContentSequence, item);
        put(*item, DCM_FrameComments, "a frame");
        (how.shared_position ? shared : own)->findOrCreateSequenceItem(DCM_PlanePositionSequence, item);
        put(*item, DCM_ImagePositionPatient, position(frame.k));
        if (!how.shared_segment && !is_map) {
            own->findOrCreateSequenceItem(DCM_SegmentIdentificationSequence, item);
            item->putAndInsertUint16(DCM_ReferencedSegmentNumber,
                                     static_cast<Uint16>(segments[frame.segment].number));
        }
        for (std::size_t i = 0; i < slice; ++i) {
            const std::size_t at = static_cast<std::size_t>(frame.k) * slice + i;
            if (!is_map) {
                words.push_back(segments[frame.segment].marked[at]);
                continue;
            }
            int value = std::max(how.background, 0);
            for (const Segment& segment : segments)
                if (segment.marked[at] > 0) value = segment.number;
            words.push_back(static_cast<Uint16>(value));
        }
    }
    put(data, DCM_NumberOfFrames, std::to_string(frames.size()));
    std::vector<Uint8> bytes;
    if (how.bits == 1) {
        bytes.assign((words.size() + 7) / 8, 0);
        for (std::size_t i = 0; i < words.size(); ++i)
            if (words[i] > 0) bytes[i / 8] = static_cast<Uint8>(bytes[i / 8] | 1 << i % 8);
    } else if (how.bits == 8) {
        for (const Uint16 word : words) bytes.push_back(static_cast<Uint8>(word));
    }
    if (bytes.size() % 2 == 1) bytes.push_back(0);
    if (how.bits == 16)
        data.putAndInsertUint16Array(DCM_PixelData, words.data(), static_cast<unsigned long>(words.size()));
    else
        data.putAndInsertUint8Array(DCM_PixelData, bytes.data(), static_cast<unsigned long>(bytes.size()));
    if (how.syntax == EXS_RLELossless) {
        DcmRLEEncoderRegistration::registerCodecs();
        const bool packed = data.chooseRepresentation(EXS_RLELossless, nullptr).good();
        DcmRLEEncoderRegistration::cleanup();
        if (!packed) throw std::runtime_error("no RLE was made");
    }
    if (file.saveFile(path.c_str(), how.syntax).bad()) throw std::runtime_error("no DICOM file was written");
}

}  // namespace test
