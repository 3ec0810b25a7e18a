#include "engine/patient/dicom_data.h"

#include <algorithm>
#include <cmath>
#include <dcmtk/dcmdata/dcpixel.h>
#include <dcmtk/dcmdata/dcpixseq.h>
#include <dcmtk/dcmdata/dcpxitem.h>
#include <dcmtk/dcmdata/dcrledrg.h>
#include <dcmtk/dcmjpeg/djdecode.h>
#include <dcmtk/dcmjpls/djdecode.h>
#include <dcmtk/oflog/oflog.h>

#include "engine/io/text.h"
#include "engine/patient/jpeg2000.h"

namespace patient {
namespace {

namespace fs = std::filesystem;
using geometry::Vec3;

/// Decoders of compressed samples, and no reports on stderr: errors go where the others go.
struct Dcmtk {
    Dcmtk() {
        OFLog::configure(OFLogger::OFF_LOG_LEVEL);
        DcmRLEDecoderRegistration::registerCodecs();
        DJDecoderRegistration::registerCodecs();
        DJLSDecoderRegistration::registerCodecs();
    }
    ~Dcmtk() {
        DcmRLEDecoderRegistration::cleanup();
        DJDecoderRegistration::cleanup();
        DJLSDecoderRegistration::cleanup();
    }
};

/// The code of one frame of JPEG 2000: its fragment, or all of them where there is one frame.
std::vector<std::uint8_t> code_of(const fs::path& path, DcmPixelSequence& fragments, int frames, int frame) {
    const auto count = static_cast<int>(fragments.card()) - 1;  // the first is a table of offsets
    if (count < 1 || (frames > 1 && count != frames))
        refuse_ct(path, fmt::format("{} fragments of {} frames were found", count, frames),
                  "expected one of each frame");
    std::vector<std::uint8_t> code;
    for (int k = frames > 1 ? frame : 0; k < (frames > 1 ? frame + 1 : count); ++k) {
        DcmPixelItem* item = nullptr;
        Uint8* bytes = nullptr;
        if (fragments.getItem(item, static_cast<unsigned long>(k) + 1).bad() || !item ||
            item->getUint8Array(bytes).bad() || !bytes)
            refuse_ct(path, "a fragment that cannot be read was found", "expected a whole DICOM file");
        code.insert(code.end(), bytes, bytes + item->getLength());
    }
    return code;
}

}  // namespace

void load_dicom(const fs::path& path, DcmFileFormat& file, std::size_t most_inflated) {
    static const Dcmtk dcmtk;
    check_dicom_depth(path, most_inflated);
    constexpr Uint32 short_values = 4096;
    if (const OFCondition read = file.loadFile(path.c_str(), EXS_Unknown, EGL_noChange, short_values);
        read.bad())
        refuse_ct(path, fmt::format("DCMTK cannot read it ({})", read.text()), "expected a whole DICOM file");
}

std::string text_of(DcmItem& data, const DcmTagKey& tag) {
    OFString value;
    data.findAndGetOFStringArray(tag, value);
    return std::string(value.c_str(), std::min<std::size_t>(value.size(), 120));
}

std::optional<double> number_of(DcmItem& data, const DcmTagKey& tag, unsigned long index) {
    OFString value;
    if (data.findAndGetOFString(tag, value, index).bad()) return std::nullopt;
    std::string_view text(value.c_str(), value.size());
    while (text.starts_with(' ')) text.remove_prefix(1);
    while (text.ends_with(' ') || text.ends_with('\0')) text.remove_suffix(1);
    if (text.starts_with('+')) text.remove_prefix(1);
    const std::optional<double> number = io::parse_number(text);
    return number && std::isfinite(*number) ? number : std::nullopt;
}

int whole_of(DcmItem& data, const DcmTagKey& tag) {
    Uint16 value = 0;
    return data.findAndGetUint16(tag, value).good() ? value : -1;
}

DcmItem& FrameGroups::item_with(DcmDataset& data, const DcmTagKey& group, const DcmTagKey& tag) const {
    for (DcmItem* from : {own, shared}) {
        DcmItem* item = nullptr;
        if (from && from->findAndGetSequenceItem(group, item).good() && item && item->tagExists(tag))
            return *item;
    }
    return data;
}

std::vector<FrameGroups> groups_of_frames(DcmDataset& data) {
    std::vector<FrameGroups> groups;
    DcmItem* shared = nullptr;
    data.findAndGetSequenceItem(DCM_SharedFunctionalGroupsSequence, shared);
    DcmSequenceOfItems* own = nullptr;
    if (data.findAndGetSequence(DCM_PerFrameFunctionalGroupsSequence, own).bad() || !own) return groups;
    for (DcmObject* item = own->nextInContainer(nullptr); item; item = own->nextInContainer(item))
        groups.push_back({dynamic_cast<DcmItem*>(item), shared});
    return groups;
}

DicomPlane plane_of(const fs::path& path, DcmDataset& data, const FrameGroups& groups) {
    DcmItem& place_item = groups.item_with(data, DCM_PlanePositionSequence, DCM_ImagePositionPatient);
    DcmItem& turn_item = groups.item_with(data, DCM_PlaneOrientationSequence, DCM_ImageOrientationPatient);
    DcmItem& spacing_item = groups.item_with(data, DCM_PixelMeasuresSequence, DCM_PixelSpacing);
    const auto place = numbers_of<3>(path, place_item, DCM_ImagePositionPatient, "ImagePositionPatient");
    const auto turn = numbers_of<6>(path, turn_item, DCM_ImageOrientationPatient, "ImageOrientationPatient");
    const auto spacing = numbers_of<2>(path, spacing_item, DCM_PixelSpacing, "PixelSpacing");
    DicomPlane plane;
    plane.position = Vec3(place[0], place[1], place[2]);
    plane.along_row = Vec3(turn[0], turn[1], turn[2]);
    plane.along_column = Vec3(turn[3], turn[4], turn[5]);
    constexpr double slack = 1e-2;
    if (std::abs(plane.along_row.norm() - 1) > slack || std::abs(plane.along_column.norm() - 1) > slack ||
        std::abs(plane.along_row.dot(plane.along_column)) > slack)
        refuse_ct(path,
                  fmt::format("ImageOrientationPatient '{}' was found",
                              text_of(turn_item, DCM_ImageOrientationPatient)),
                  "expected two perpendicular unit vectors");
    plane.row_step = spacing[0];
    plane.column_step = spacing[1];
    if (!(plane.row_step > 0 && plane.column_step > 0))
        refuse_ct(path, fmt::format("PixelSpacing '{}' was found", text_of(spacing_item, DCM_PixelSpacing)),
                  "expected two numbers above 0");
    return plane;
}

StoredSamples::StoredSamples(const fs::path& path, DcmDataset& data, int columns, int rows)
    : path_(path),
      samples_(static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns)),
      columns_(columns),
      rows_(rows),
      frames_(std::max(1, static_cast<int>(number_of(data, DCM_NumberOfFrames, 0).value_or(1)))) {
    const E_TransferSyntax syntax = data.getOriginalXfer();
    DcmElement* element = nullptr;
    if ((syntax == EXS_JPEG2000LosslessOnly || syntax == EXS_JPEG2000) &&
        data.findAndGetElement(DCM_PixelData, element).good() && element) {
        auto* const pixels = dynamic_cast<DcmPixelData*>(element);
        if (!pixels || pixels->getEncapsulatedRepresentation(syntax, nullptr, fragments_).bad() ||
            !fragments_)
            refuse_ct(path_, "samples compressed as JPEG 2000 that cannot be read were found",
                      "expected a whole DICOM file");
        return;
    }
    if (const OFCondition decoded = data.chooseRepresentation(EXS_LittleEndianExplicit, nullptr);
        decoded.bad())
        refuse_ct(path_,
                  fmt::format("samples compressed as '{}' cannot be read ({})", DcmXfer(syntax).getXferName(),
                              decoded.text()),
                  "expected uncompressed samples, RLE, JPEG, JPEG-LS or JPEG 2000");
    unsigned long found = 0;
    const bool wide = whole_of(data, DCM_BitsAllocated) > 8;
    if (wide && (data.findAndGetUint16Array(DCM_PixelData, words_, &found).bad() || !words_)) found = 0;
    if (!wide && (data.findAndGetUint8Array(DCM_PixelData, bytes_, &found).bad() || !bytes_)) found = 0;
    found_ = found;
}

const std::uint16_t* StoredSamples::of(int frame) {
    if (fragments_) {
        const std::vector<std::uint8_t> code = code_of(path_, *fragments_, frames_, frame);
        decoded_ = decode_jpeg2000(code, columns_, rows_, path_);
        return decoded_.data();
    }
    const std::size_t first = samples_ * static_cast<std::size_t>(frame);
    if (found_ < first + samples_)
        refuse_ct(path_, fmt::format("{} samples were found", found_),
                  frame == 0
                      ? fmt::format("expected {} × {}", columns_, rows_)
                      : fmt::format("expected {} × {} in each of {} frames", columns_, rows_, frames_));
    if (words_) return words_ + first;
    decoded_.assign(bytes_ + first, bytes_ + first + samples_);
    return decoded_.data();
}

}  // namespace patient
