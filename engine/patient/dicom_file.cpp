#include "engine/patient/dicom_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <dcmtk/dcmdata/dcpixel.h>
#include <dcmtk/dcmdata/dcpixseq.h>
#include <dcmtk/dcmdata/dcpxitem.h>
#include <dcmtk/dcmdata/dcrledrg.h>
#include <dcmtk/dcmdata/dctk.h>
#include <dcmtk/dcmjpeg/djdecode.h>
#include <dcmtk/dcmjpls/djdecode.h>
#include <dcmtk/oflog/oflog.h>
#include <fmt/format.h>

#include "engine/io/text.h"
#include "engine/patient/dicom_depth.h"
#include "engine/patient/jpeg2000.h"

namespace patient {
namespace {

namespace fs = std::filesystem;
using geometry::Vec3;

constexpr int most_frames = 20'000;

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

template <std::size_t N>
std::array<double, N> numbers_of(const fs::path& path, DcmItem& data, const DcmTagKey& tag,
                                 const char* name) {
    std::array<double, N> result;
    for (std::size_t i = 0; i < N; ++i) {
        const auto number = number_of(data, tag, i);
        if (!number)
            refuse_ct(path, fmt::format("'{}' was found for {}", text_of(data, tag), name),
                      fmt::format("expected {} finite numbers", N));
        result[i] = *number;
    }
    return result;
}

int whole_of(DcmItem& data, const DcmTagKey& tag) {
    Uint16 value = 0;
    return data.findAndGetUint16(tag, value).good() ? value : -1;
}

/// Items in which the parameters of a frame of an enhanced CT lie: its own, then those of all.
struct FrameGroups {
    DcmItem* own = nullptr;
    DcmItem* shared = nullptr;

    /// The item of a group that has the tag. Without one the data set's own, as in a file of one slice.
    DcmItem& item_with(DcmDataset& data, const DcmTagKey& group, const DcmTagKey& tag) const {
        for (DcmItem* from : {own, shared}) {
            DcmItem* item = nullptr;
            if (from && from->findAndGetSequenceItem(group, item).good() && item && item->tagExists(tag))
                return *item;
        }
        return data;
    }
};

FrameGroups groups_of(DcmDataset& data, int frame) {
    FrameGroups groups;
    data.findAndGetSequenceItem(DCM_PerFrameFunctionalGroupsSequence, groups.own, frame);
    data.findAndGetSequenceItem(DCM_SharedFunctionalGroupsSequence, groups.shared);
    return groups;
}

/// Where a slice lies and what its numbers mean.
void read_place(const fs::path& path, DcmDataset& data, const FrameGroups& groups, DicomSlice& slice) {
    DcmItem& place_item = groups.item_with(data, DCM_PlanePositionSequence, DCM_ImagePositionPatient);
    DcmItem& turn_item = groups.item_with(data, DCM_PlaneOrientationSequence, DCM_ImageOrientationPatient);
    DcmItem& spacing_item = groups.item_with(data, DCM_PixelMeasuresSequence, DCM_PixelSpacing);
    DcmItem& value_item = groups.item_with(data, DCM_PixelValueTransformationSequence, DCM_RescaleSlope);
    const auto place = numbers_of<3>(path, place_item, DCM_ImagePositionPatient, "ImagePositionPatient");
    const auto turn = numbers_of<6>(path, turn_item, DCM_ImageOrientationPatient, "ImageOrientationPatient");
    const auto spacing = numbers_of<2>(path, spacing_item, DCM_PixelSpacing, "PixelSpacing");
    slice.position = Vec3(place[0], place[1], place[2]);
    slice.along_row = Vec3(turn[0], turn[1], turn[2]);
    slice.along_column = Vec3(turn[3], turn[4], turn[5]);
    constexpr double slack = 1e-2;
    if (std::abs(slice.along_row.norm() - 1) > slack || std::abs(slice.along_column.norm() - 1) > slack ||
        std::abs(slice.along_row.dot(slice.along_column)) > slack)
        refuse_ct(path,
                  fmt::format("ImageOrientationPatient '{}' was found",
                              text_of(turn_item, DCM_ImageOrientationPatient)),
                  "expected two perpendicular unit vectors");
    slice.row_step = spacing[0];
    slice.column_step = spacing[1];
    if (!(slice.row_step > 0 && slice.column_step > 0))
        refuse_ct(path, fmt::format("PixelSpacing '{}' was found", text_of(spacing_item, DCM_PixelSpacing)),
                  "expected two numbers above 0");
    slice.rescale.slope = numbers_of<1>(path, value_item, DCM_RescaleSlope, "RescaleSlope")[0];
    slice.rescale.intercept = numbers_of<1>(path, value_item, DCM_RescaleIntercept, "RescaleIntercept")[0];
}

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

/// Samples as they are stored, 16 bits each, of one file's frames.
class StoredSamples {
public:
    StoredSamples(const DicomSlice& like, DcmDataset& data)
        : path_(like.file),
          samples_(static_cast<std::size_t>(like.rows) * static_cast<std::size_t>(like.columns)),
          columns_(like.columns),
          rows_(like.rows),
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
                      fmt::format("samples compressed as '{}' cannot be read ({})",
                                  DcmXfer(syntax).getXferName(), decoded.text()),
                      "expected uncompressed samples, RLE, JPEG, JPEG-LS or JPEG 2000");
        unsigned long found = 0;
        if (data.findAndGetUint16Array(DCM_PixelData, words_, &found).bad() || !words_) found = 0;
        found_ = found;
    }
    /// Valid until the next call.
    const std::uint16_t* of(int frame) {
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
        return words_ + first;
    }

private:
    const fs::path& path_;
    std::size_t samples_, found_ = 0;
    int columns_, rows_, frames_;
    const Uint16* words_ = nullptr;
    DcmPixelSequence* fragments_ = nullptr;
    std::vector<std::uint16_t> decoded_;
};

void start_dcmtk() {
    static const Dcmtk dcmtk;
}

}  // namespace

bool has_dicom_mark(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    char mark[4] = {};
    return file.seekg(128) && file.read(mark, 4) && std::string_view(mark, 4) == "DICM";
}

std::vector<DicomSlice> dicom_slices(const fs::path& path) {
    start_dcmtk();
    check_dicom_depth(path);
    DcmFileFormat file;
    constexpr Uint32 short_values = 4096;  // longer ones stay in the file: the samples
    if (const OFCondition read = file.loadFile(path.c_str(), EXS_Unknown, EGL_noChange, short_values);
        read.bad())
        refuse_ct(path, fmt::format("DCMTK cannot read it ({})", read.text()), "expected a whole DICOM file");
    DcmDataset& data = *file.getDataset();
    if (text_of(data, DCM_Modality) != "CT" || !data.tagExists(DCM_PixelData)) return {};
    if (text_of(data, DCM_ImageType).find("LOCALIZER") != std::string::npos) return {};
    // Pictures of the screen, such as dose reports, bear the scanner's modality.
    if (text_of(data, DCM_SOPClassUID).starts_with(UID_SecondaryCaptureImageStorage)) return {};
    DicomSlice slice;
    slice.file = path;
    slice.uid = text_of(data, DCM_SOPInstanceUID);
    slice.series = text_of(data, DCM_SeriesInstanceUID);
    slice.number = text_of(data, DCM_SeriesNumber);
    slice.description = text_of(data, DCM_SeriesDescription);
    if (slice.series.empty()) refuse_ct(path, "no SeriesInstanceUID was found", "one is needed");
    slice.rows = whole_of(data, DCM_Rows);
    slice.columns = whole_of(data, DCM_Columns);
    if (slice.rows < 2 || slice.columns < 2)
        refuse_ct(path, fmt::format("{} rows and {} columns were found", slice.rows, slice.columns),
                  "expected 2 or more of each");
    const int bits = whole_of(data, DCM_BitsAllocated), per_pixel = whole_of(data, DCM_SamplesPerPixel);
    if (bits != 16 || per_pixel != 1 || text_of(data, DCM_PhotometricInterpretation) != "MONOCHROME2")
        refuse_ct(path,
                  fmt::format("{} bits in {} values a sample, '{}', were found", bits, per_pixel,
                              text_of(data, DCM_PhotometricInterpretation)),
                  "expected 16 bits in one value, MONOCHROME2");
    const double frames = number_of(data, DCM_NumberOfFrames, 0).value_or(1);
    const bool enhanced = data.tagExists(DCM_PerFrameFunctionalGroupsSequence);
    if (!(frames == std::floor(frames) && frames >= 1 && frames <= most_frames) || (frames > 1 && !enhanced))
        refuse_ct(path,
                  fmt::format("{:g} frames{} were found", frames, enhanced ? "" : " without a place of each"),
                  fmt::format("expected one slice, or an enhanced CT of up to {} frames", most_frames));
    std::vector<DicomSlice> slices;
    for (slice.frame = 0; slice.frame < static_cast<int>(frames); ++slice.frame) {
        read_place(path, data, enhanced ? groups_of(data, slice.frame) : FrameGroups{}, slice);
        slices.push_back(slice);
    }
    // Compressed or not, a sample takes some room: no header asks for memory that its file does not fill.
    constexpr double largest_ratio = 1000;
    std::error_code failed;
    const auto size = static_cast<double>(fs::file_size(path, failed));
    if (failed || 2.0 * frames * slice.rows * slice.columns > largest_ratio * size)
        refuse_ct(path,
                  fmt::format("its header asks for {} × {} samples, more than it can hold", slice.columns,
                              slice.rows),
                  "expected a whole DICOM file");
    return slices;
}

void read_dicom_slices(std::span<const DicomSlice* const> slices, std::span<std::int16_t* const> to) {
    const DicomSlice& first = *slices.front();
    check_dicom_depth(first.file);  // it may have changed since
    DcmFileFormat file;
    if (const OFCondition read = file.loadFile(first.file.c_str()); read.bad())
        refuse_ct(first.file, fmt::format("DCMTK cannot read it ({})", read.text()),
                  "expected a whole DICOM file");
    DcmDataset& data = *file.getDataset();
    const bool is_signed = whole_of(data, DCM_PixelRepresentation) == 1;
    int stored = whole_of(data, DCM_BitsStored);
    if (stored < 1 || stored > 16) stored = 16;
    const int unused = 16 - stored;  // bits above the highest, which may hold anything
    StoredSamples samples(first, data);
    for (std::size_t k = 0; k < slices.size(); ++k) {
        const DicomSlice& slice = *slices[k];
        const std::uint16_t* const words = samples.of(slice.frame);
        const std::size_t count =
            static_cast<std::size_t>(slice.rows) * static_cast<std::size_t>(slice.columns);
        for (std::size_t i = 0; i < count; ++i) {
            const auto shifted = static_cast<std::uint16_t>(words[i] << unused);
            const double value = is_signed ? static_cast<std::int16_t>(shifted) >> unused : shifted >> unused;
            const auto hu = as_hu(slice.rescale.slope * value + slice.rescale.intercept);
            if (!hu) refuse_ct(slice.file, "a value that is not finite was found", "expected finite values");
            to[k][i] = *hu;
        }
    }
}

}  // namespace patient
